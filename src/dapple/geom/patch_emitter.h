// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <optional>

#include "dapple/geom/emitter_sample.h"

namespace dapple::geom {

/// A bilinear patch that emits: p(u, v) = (1-u)(1-v) p00 + u(1-v) p10 + (1-u)v p01 + uv p11.
/// Rectangles are drawn uniformly in solid angle (Urena, Fajardo & King 2013, "An area-preserving parametrization for spherical
/// rectangles"). Other patches are drawn from a density that is bilinear in u and v, with the stretch |dp/du x dp/dv| at the
/// corners: uniform by area where the patch is planar and convex, and nearly so elsewhere; pdf() is exact for both.
/// Patches that fold over themselves are outside this class: their density is that of the branch that sample() drew.
class PatchEmitter {
 public:
  using UV = std::array<V2f, 4>;
  static constexpr double min_solid_angle = 1e-6;  ///< sr; smaller rectangles are drawn by area

  /// The normal is that of dp/du x dp/dv, or the opposite if `flip`. uv at p00, p10, p01, p11; (u, v) if absent.
  PatchEmitter(const V3f& p00, const V3f& p10, const V3f& p01, const V3f& p11, bool flip,
               const std::optional<UV>& uv = std::nullopt);

  bool sample(const V3f& ref, const V2f& u, EmitterSample* out) const;
  /// Density (solid angle) with which sample() returns the direction wi of p, a point of the patch seen from ref.
  float pdf(const V3f& ref, const V3f& wi, const V3f& p, const V3f& n) const;

  float area() const { return area_; }  ///< m^2
  Box3f bounds() const;
  NormalCone normal_cone() const;
  bool is_planar() const { return kind_ != Kind::curved; }
  bool is_rectangle() const { return kind_ == Kind::rectangle; }

 private:
  enum class Kind : uint8_t { rectangle, planar, curved };

  V3f point(const V2f& st) const;
  V3f cross_derivatives(const V2f& st) const;  // dp/du x dp/dv, flipped
  float density(const V2f& st) const;          // over u, v
  V2f invert(const V3f& p) const;              // (u, v) of a point of the patch
  V2f uv_at(const V2f& st) const;

  V3f p00_, p10_, p01_, p11_;
  std::array<float, 4> stretch_;  // |dp/du x dp/dv| at 00, 10, 01, 11
  float area_;
  Kind kind_;
  bool flip_;
  std::unique_ptr<const UV> uv_;
};

}  // namespace dapple::geom
