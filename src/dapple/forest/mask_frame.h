// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/vec.h"

namespace dapple::forest {

/// The scene as seen from a light at infinity: a grid of square pixels across its direction, and slabs along it. Grid
/// coordinates are (column, row, level), each continuous: pixel (i, j) covers columns [i, i + 1) and rows [j, j + 1),
/// slab k levels [k, k + 1). Levels grow away from the light.
struct MaskFrame {
  /// Steeper surfaces, by the tangents of their angle to a plane across the light along columns and rows together,
  /// count as this steep: 86 degrees or more.
  static constexpr float steepest = 23;

  V3f x{1, 0, 0}, y{0, 1, 0}, to_light{0, 0, 1};  ///< orthonormal, right-handed
  float pitch = 1;                                ///< side of a pixel, m
  float slab = 1;                                 ///< thickness of a slab, m

  MaskFrame() = default;
  /// to_light: unit.
  MaskFrame(const V3f& direction, float pixel_m, float slab_m) : to_light(direction), pitch(pixel_m), slab(slab_m) {
    coordinate_system(to_light, &x, &y);
  }

  V3f to_grid(const V3f& p) const { return {dot(p, x) / pitch, dot(p, y) / pitch, -dot(p, to_light) / slab}; }
  /// Levels that a plane of normal n gains over a pixel, along columns and along rows; 0 for normal 0.
  V2f slope(const V3f& n) const {
    const V2f across(dot(n, x), dot(n, y));
    const float along = dot(n, to_light), sum = std::abs(across.x) + std::abs(across.y);
    if (!(sum > 0)) return {0, 0};
    const float levels = std::min(sum / std::max(std::abs(along), 1e-6f), steepest) * (pitch / slab) / sum;
    return across * (along < 0 ? -levels : levels);
  }
};

}  // namespace dapple::forest
