// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <vector>

#include "dapple/base/vec.h"
#include "dapple/trace/ray_batch.h"

namespace dapple::scene {

/// Which lights of a scene are media that glow (emitters::GlowLight), and what belongs to each: all that a medium emits
/// along ways through it that begin in a place. So which light it is hangs neither on where a way ends nor on how its
/// ray was drawn, and no emission belongs to two.
class GlowTable {
 public:
  /// Light number `light`; those that follow are of this kind, too. Places of a medium have nothing in common.
  void add(int32_t medium, const Box3f& place, uint32_t light) {
    if (places_.size() <= size_t(medium)) places_.resize(size_t(medium) + 1);
    places_[size_t(medium)].push_back({place, light});
    first_ = std::min(first_, light);
  }
  bool empty() const { return places_.empty(); }
  uint32_t first_light() const { return first_; }  ///< no_id: there is none
  /// no_id: none.
  uint32_t light(int32_t medium, const V3f& p) const {
    if (size_t(medium) >= places_.size()) return trace::no_id;
    for (const Place& place : places_[size_t(medium)])
      if (place.box.intersects(p)) return place.light;
    return trace::no_id;
  }

 private:
  struct Place {
    Box3f box;
    uint32_t light;
  };
  std::vector<std::vector<Place>> places_;  // by medium
  uint32_t first_ = trace::no_id;
};

}  // namespace dapple::scene
