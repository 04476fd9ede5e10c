// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "dapple/base/rgb.h"
#include "dapple/base/vec.h"

namespace dapple::vegetation {

/// A leaf that a path met, in units of what the path brings to its pixel.
struct CanopyEvidence {
  V3f P, n;   ///< n: unit, on the side on which the path came
  RGB told;   ///< by the canopy's solution for light that leaves had scattered before
  RGB found;  ///< of that light, by the path
};

/// What a canopy's solution, which knows height and normal alone, is to be multiplied by, so that it agrees in the mean
/// with paths through the leaves themselves: by height, by how far the leaf's side looks up or down, and by channel.
/// Estimates of few paths lean on those of the whole height, and these on those of all directions, as far as they
/// differ by no more than chance, whose part is a moment estimate after DerSimonian and Laird 1986 ("Meta-analysis in
/// clinical trials").
class CanopyFactors {
 public:
  /// 1 everywhere.
  CanopyFactors() = default;
  explicit CanopyFactors(std::span<const CanopyEvidence> evidence);

  RGB at(float z, const V3f& n) const {
    if (knots_.empty()) return RGB(1);
    const float x = std::clamp((z - lowest_) * per_metre_, 0.0f, float(heights - 1));
    const float y = std::clamp(n.z / outermost + 1, 0.0f, 2.0f);
    const int i = std::min(int(x), heights - 2), side = y < 1 ? 0 : 1;
    const auto along = [&](int row) {
      return lerp(x - float(i), knots_[size_t(row)], knots_[size_t(row + directions)]);
    };
    return lerp(y - float(side), along(i * directions + side), along(i * directions + side + 1));
  }
  /// Standard deviation, relative to what is told, by which the answers, so multiplied, are off from place to place and
  /// in the mean, as far as the evidence tells: with little of it more. Infinite without evidence.
  float error() const { return error_; }

 private:
  static constexpr int heights = 8, directions = 3;  // knots; sides that look down, aside, up
  static constexpr float outermost = 0.75f;          // z of normals at the outer knots: the mean from .5 to 1

  static RGB lerp(float t, const RGB& a, const RGB& b) { return a * (1 - t) + b * t; }
  int knot_of(const CanopyEvidence& e) const;
  void estimate_error(std::span<const CanopyEvidence> evidence);

  float lowest_ = 0, per_metre_ = 0, error_ = infinity;
  std::vector<RGB> knots_;
};

}  // namespace dapple::vegetation
