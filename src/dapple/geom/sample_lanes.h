// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <span>

#include "dapple/geom/emitter_sample.h"

namespace dapple::geom {

/// The random numbers of samples that are drawn at once, as arrays, so that loops over them become vector code: filled
/// up to whole vectors unless there is but one.
class SampleLanes {
 public:
  alignas(64) double x[most_at_once], y[most_at_once];

  explicit SampleLanes(std::span<const V2f> u)
      : count_(u.size() == 1 ? 1 : (int(u.size()) + width - 1) / width * width) {
    for (int i = 0; i < count_; ++i) {
      const V2f& of = u[std::min(size_t(i), u.size() - 1)];
      x[i] = of.x, y[i] = of.y;
    }
  }
  template <class Do>
  void each(const Do& draw) const {
    if (count_ == 1) return draw(0);
    for (int i = 0; i < count_; ++i) draw(i);
  }

 private:
  static constexpr int width = 4;  // of doubles, in AVX2
  static_assert(most_at_once % width == 0);
  int count_;
};

}  // namespace dapple::geom
