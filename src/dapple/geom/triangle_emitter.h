// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>

#include "dapple/geom/emitter_sample.h"

namespace dapple::geom {

/// A triangle that emits. Points are drawn uniformly in solid angle (Arvo 1995, "Stratified sampling of spherical
/// triangles") where the triangle subtends between min_solid_angle and max_solid_angle, and uniformly by area
/// otherwise, where Arvo's construction loses its precision. 48 bytes, because a scene may have a million.
class TriangleEmitter {
 public:
  using UV = std::array<V2f, 3>;
  /// Radius over distance below which density is uniform in area; the squared distance then varies by less than a
  /// factor of three.
  static constexpr float small_angle = 0.25f;
  static constexpr double min_solid_angle = 1e-6;  ///< sr
  static constexpr double max_solid_angle = 6.2;   ///< sr; a hemisphere has 6.283

  /// The normal is that of (p1 - p0) x (p2 - p0), or the opposite if `flip`. uv: (0, 0), (1, 0), (1, 1) if absent.
  TriangleEmitter(const V3f& p0, const V3f& p1, const V3f& p2, bool flip, const std::optional<UV>& uv = std::nullopt);

  /// False where nothing can be drawn (ref in the plane or at a vertex).
  bool sample(const V3f& ref, const V2f& u, EmitterSample* out) const { return sample(ref, {&u, 1}, out); }
  /// The same for up to most_at_once u: bit i of the result is set where out[i] was drawn.
  uint32_t sample(const V3f& ref, std::span<const V2f> u, EmitterSample* out) const;
  /// Density (solid angle) with which sample() returns the direction wi of p, a point of the triangle seen from ref.
  float pdf(const V3f& ref, const V3f& wi, const V3f& p, const V3f& n) const;

  float area() const;  ///< m^2; 0 or not finite for degenerate triangles
  Box3f bounds() const;
  NormalCone normal_cone() const { return {normal(), 1}; }
  V3f normal() const;

 private:
  V2f uv_at(const V3f& barycentric) const;

  V3f p0_, p1_, p2_;  // in an order that puts the emitting side in front: p1 and p2 swap if flipped
  bool swapped_;
  std::unique_ptr<const UV> uv_;
};

}  // namespace dapple::geom
