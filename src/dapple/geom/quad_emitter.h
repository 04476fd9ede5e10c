// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include "dapple/geom/triangle_emitter.h"

namespace dapple::geom {

/// A quad that emits: the two triangles (0, 1, 3) and (2, 3, 1) that a quad is traced as. One of them is chosen in
/// proportion to area, and drawn as a TriangleEmitter.
class QuadEmitter {
 public:
  using UV = std::array<V2f, 4>;

  /// Corners in order around it. The normal is that of (c1 - c0) x (c3 - c0), or the opposite if `flip`. uv: those of
  /// the corners; (0, 0), (1, 0), (1, 1), (0, 1) if absent.
  QuadEmitter(const V3f corners[4], bool flip, const std::optional<UV>& uv = std::nullopt);

  bool sample(const V3f& ref, const V2f& u, EmitterSample* out) const;
  /// Density (solid angle) with which sample() returns the direction wi of p, a point of the quad seen from ref.
  float pdf(const V3f& ref, const V3f& wi, const V3f& p, const V3f& n) const;

  float area() const { return triangles_[0].area() + triangles_[1].area(); }  ///< m^2
  Box3f bounds() const;
  NormalCone normal_cone() const;

 private:
  std::array<TriangleEmitter, 2> triangles_;
  V3f on_diagonal_, across_;  // dot(p - on_diagonal_, across_) > 0 on the first triangle
  float first_;               // its share of the area
};

}  // namespace dapple::geom
