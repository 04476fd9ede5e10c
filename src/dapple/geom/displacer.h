// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "dapple/geom/patch_surface.h"

namespace dapple::geom {

/// Port through which a surface is displaced while it is diced; shading fills it.
class Displacer {
 public:
  static constexpr size_t capacity = 256;
  virtual ~Displacer() = default;
  /// Writes heights[0, points.size()), in the units of P along N, for at most `capacity` points. The points'
  /// derivatives are those by one micropolygon of the grid: the footprint to filter over. Thread-safe and pure.
  virtual void heights(std::span<const PatchSample> points, float* heights) const = 0;
};

}  // namespace dapple::geom
