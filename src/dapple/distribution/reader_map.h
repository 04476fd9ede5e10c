// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "dapple/emitters/region_tree.h"

namespace dapple::distribution {

/// How many diffuse rays of an image end where: what is cached there is read so often. Immutable once it is filled, and
/// thread-safe.
class ReaderMap {
 public:
  /// A place where a ray ended, and the normal of the side that it met: LightReceiver::p and n.
  using Reader = emitters::LightReceiver;

  /// Nothing is known yet of diffuse depth depths() + 1: `readers` are some rays of that depth, each of which stands
  /// for so many.
  void add_depth(std::span<const Reader> readers, float rays_each);
  int depths() const { return int(depths_.size()); }
  /// Depth 0, of what is seen in media, is never known.
  bool knows(int depth) const { return depth >= 1 && depth <= depths(); }

  /// Rays of this diffuse depth that end on `area` m2 around a place, as an estimate within a third;
  /// infinite of depths of which nothing is known.
  float readers(const Reader& at, int depth, float area) const {
    if (!knows(depth)) return infinity;
    const OfDepth& of = depths_[size_t(depth - 1)];
    return of.density[size_t(of.regions.home(at))] * area;
  }

 private:
  struct OfDepth {
    emitters::RegionTree regions;
    std::vector<float> density;  // by region: rays a square metre
  };
  std::vector<OfDepth> depths_;
};

}  // namespace dapple::distribution
