// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/vec.h"

namespace dapple::scattering {

/// Anisotropic Trowbridge-Reitz (GGX) distribution of microfacet normals about +z, with height-correlated Smith masking
/// (Heitz 2014) and sampling of visible normals by a spherical cap (Dupuy & Benyoub 2023). Directions are unit and in
/// the local frame; those of wo and wi may lie on either side, masking being symmetric.
class Ggx {
 public:
  /// Below it a surface is treated as perfectly smooth.
  static constexpr float smooth_alpha = 1e-3f;

  Ggx(float alpha_x, float alpha_y)
      : ax_(std::max(alpha_x, 1e-4f)),
        ay_(std::max(alpha_y, 1e-4f)),
        smooth_(std::max(alpha_x, alpha_y) < smooth_alpha) {}

  bool is_smooth() const { return smooth_; }

  /// Density of normals D(m), m.z > 0; its integral of D cos is one.
  float distribution(const V3f& m) const {
    const float v = sqr(m.x / ax_) + sqr(m.y / ay_) + sqr(m.z);
    return 1 / (pi * ax_ * ay_ * v * v);
  }

  /// G2(wo, wi) / (4 |cos_o cos_i|).
  float masking_over_4cos(const V3f& wo, const V3f& wi) const {
    return 1 / (2 * (std::abs(wi.z) * stretched_length(wo) + std::abs(wo.z) * stretched_length(wi)));
  }

  /// Density of the visible normals of w: G1(w) D(m) |w.m| / |w.z|.
  float visible_pdf(const V3f& w, const V3f& m) const {
    return visible_share(w) * distribution(m) * std::abs(dot(w, m));
  }
  /// G1(w) / |w.z|.
  float visible_share(const V3f& w) const { return 2 / (std::abs(w.z) + stretched_length(w)); }

  /// A normal (z > 0) visible from w, w.z >= 0.
  V3f sample_visible(const V3f& w, const V2f& u) const {
    const V3f h = normalize(V3f(ax_ * w.x, ay_ * w.y, w.z));
    const float phi = 2 * pi * u.x;
    const float z = (1 - u.y) * (1 + h.z) - h.z;
    const float r = safe_sqrt(1 - z * z);
    const V3f c = V3f(r * std::cos(phi), r * std::sin(phi), z) + h;
    return normalize(V3f(ax_ * c.x, ay_ * c.y, std::max(c.z, 1e-7f)));
  }

 private:
  float stretched_length(const V3f& w) const { return std::sqrt(sqr(ax_ * w.x) + sqr(ay_ * w.y) + sqr(w.z)); }

  float ax_, ay_;
  bool smooth_;
};

}  // namespace dapple::scattering
