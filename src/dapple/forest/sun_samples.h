// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "dapple/base/vec.h"

namespace dapple::forest {

/// Points of the unit disc with which a sun is sampled: blue noise, `count` points of equal weight, in `sets` rotations
/// of one pattern. Deterministic.
class SunSamples {
 public:
  static constexpr int most = 1024;

  /// brightness(r), r in [0, 1]: radiance from the middle to the rim, such as limb darkening; points are as dense as it
  /// is bright. Empty: even. std::invalid_argument unless 1 <= count <= most and 1 <= sets <= 4096.
  SunSamples(int count, int sets, const std::function<double(double)>& brightness = {});

  int count() const { return count_; }
  int sets() const { return sets_; }
  V2f point(int set, int i) const { return points_[size_t(set) * size_t(count_) + size_t(i)]; }
  /// Two further numbers in [0, 1) of the same point, well spread over the set.
  V2f dither(int set, int i) const { return dithers_[size_t(set) * size_t(count_) + size_t(i)]; }
  /// The set of a pixel: neighbours get rotations that differ much, so that what noise is left is of high frequency.
  int set_of_pixel(int x, int y) const;

 private:
  int count_, sets_;
  std::vector<V2f> points_, dithers_;
};

}  // namespace dapple::forest
