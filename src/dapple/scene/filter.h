// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/base/vec.h"

namespace dapple::scene {

enum class FilterKind { box, triangle, gaussian, mitchell, sinc };

/// A separable reconstruction filter, importance sampled: each camera sample belongs to one pixel and is placed by the
/// filter (Ernst et al. 2006), so tiles never share pixels and sums keep a fixed order.
class Filter {
 public:
  /// Parameters as in pbrt-v4. radius in pixels; a, b: gaussian sigma (both axes); mitchell B, C; sinc tau (a).
  Filter(FilterKind kind, const V2f& radius, float a, float b);
  static Filter box(float radius) { return {FilterKind::box, V2f(radius, radius), 0, 0}; }

  struct Sample {
    V2f offset;    ///< from the pixel's centre, pixels
    float weight;  ///< relative, negative in negative lobes; the pixel is sum(weight L) / sum(weight)
  };
  Sample sample(const V2f& u) const {
    if (kind_ == FilterKind::box) return {V2f((2 * u.x - 1) * radius_.x, (2 * u.y - 1) * radius_.y), 1};
    return sample_general(u);
  }
  float evaluate(const V2f& offset) const { return evaluate(0, offset.x) * evaluate(1, offset.y); }
  const V2f& radius() const { return radius_; }
  bool has_negative_lobes() const { return has_negative_lobes_; }

 private:
  struct Axis {
    std::vector<float> cdf;  ///< of |f| over the bins of [-radius, radius]
    float total = 0;         ///< integral of |f| over the axis
  };
  float evaluate(int axis, float x) const;
  Sample sample_general(const V2f& u) const;
  float sample_axis(int axis, float u, float* weight) const;

  FilterKind kind_;
  V2f radius_;
  float a_, b_;
  Axis axes_[2];
  bool has_negative_lobes_ = false;
};

/// The weight with which a camera sample joins a pixel whose weights add up to `sum` so far: the filter's own, without
/// its sign where the sum would come near 0. Negative lobes of a few samples cancel the others' weights, but not their
/// light, which would be divided by next to nothing.
inline float joining_weight(float weight, double sum) {
  constexpr double least = 0.9;  // of weights around 1 and -1
  return weight < 0 && sum + double(weight) < least ? -weight : weight;
}

}  // namespace dapple::scene
