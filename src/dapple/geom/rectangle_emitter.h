// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>

#include "dapple/geom/emitter_sample.h"

namespace dapple::geom {

/// A rectangle that emits. Points are drawn uniformly in solid angle (Urena, Fajardo & King 2013, "An area-preserving
/// parametrization for spherical rectangles"), and uniformly by area where it subtends less than min_solid_angle.
class RectangleEmitter {
 public:
  using UV = std::array<V2f, 4>;
  static constexpr double min_solid_angle = 1e-6;  ///< sr

  /// True if the four corners, in order around it, are those of a rectangle within rounding.
  static bool is_rectangle(const V3f corners[4]);
  /// Corners in order around it. The normal is that of (c1 - c0) x (c3 - c0), or the opposite if `flip`. uv: those of
  /// the corners; (0, 0), (1, 0), (1, 1), (0, 1) if absent.
  RectangleEmitter(const V3f corners[4], bool flip, const std::optional<UV>& uv = std::nullopt);

  /// False where nothing can be drawn (ref in the plane).
  bool sample(const V3f& ref, const V2f& u, EmitterSample* out) const { return sample(ref, {&u, 1}, out); }
  /// The same for up to most_at_once u: bit i of the result is set where out[i] was drawn.
  uint32_t sample(const V3f& ref, std::span<const V2f> u, EmitterSample* out) const;
  /// Density (solid angle) with which sample() returns the direction wi of p, a point of the rectangle seen from ref.
  float pdf(const V3f& ref, const V3f& wi, const V3f& p, const V3f& n) const;

  float area() const { return float(width_ * height_); }  ///< m^2; 0 or not finite for degenerate ones
  Box3f bounds() const;
  NormalCone normal_cone() const { return {normal(), 1}; }
  const V3f& normal() const { return normal_; }

 private:
  struct Spherical;
  V2f uv_at(const V2f& st) const;

  V3f corner_, ex_, ey_;
  double width_, height_;
  V3d x_, y_, z_;  ///< unit, along the sides and across
  V3f normal_;
  std::unique_ptr<const UV> uv_;
};

}  // namespace dapple::geom
