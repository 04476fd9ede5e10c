// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "dapple/base/rgb.h"
#include "dapple/pattern/shading_points.h"

namespace dapple::emitters {

/// A batch of places and directions in which light leaves a source, structure of arrays. World space where nothing else
/// is said.
struct LightPoints {
  static constexpr int capacity = pattern::ShadingPoints::capacity;

  int count = 0;
  pattern::Lanes3<capacity> P;  ///< where light leaves; of sources at a point, that point
  pattern::Lanes3<capacity> N;  ///< unit normal of the surface that shines, on the side of d; 0 of sources at a point
  pattern::Lanes3<capacity> d;  ///< unit direction of propagation
  /// d in the source's axes: of a spot and a projector x to the right, y up and z along the axis, as seen from it; of
  /// other sources at a point the light's own; of a surface z along N, x and y any two across it.
  pattern::Lanes3<capacity> local;
  /// Of a surface that shines, its own; of sources at a point those of textures over directions (docs/guide/lights.md).
  alignas(64) float u[capacity], v[capacity];
};

/// A program for what a light sends where. Pure; thread-safe.
class LightShader {
 public:
  virtual ~LightShader() = default;
  /// L[0, points.count): what the light sends without the shader; becomes what it sends. Radiance of surfaces,
  /// intensity of sources at a point. Where that is black the shader may not be asked.
  virtual void emission(const LightPoints& points, RGB* L) const = 0;
};

using LightShaderPtr = std::shared_ptr<const LightShader>;

}  // namespace dapple::emitters
