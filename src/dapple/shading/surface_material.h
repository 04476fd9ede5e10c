// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/pattern/input.h"
#include "dapple/shading/material.h"
#include "dapple/shading/surface_detail.h"

namespace dapple::shading {

/// GGX roughness as a user gives it, along u and v, in [0, 1]; alpha = sqrt(roughness) where remapped, else the same
/// number. Values of textures outside [0, 1] are clamped, NaN is zero.
struct RoughnessInput {
  pattern::Input<float> u{0.0f}, v{0.0f};
  bool remap = true;

  float alpha(float roughness) const {
    const float r = roughness > 0 ? std::min(roughness, 1.0f) : 0.0f;
    return remap ? std::sqrt(r) : r;
  }
};

/// What the materials of one Bsdf kind share: constant ones take a fast path, and the frame comes from the surface's
/// detail.
class SurfaceMaterial : public Material {
 public:
  void prelighting(const pattern::ShadingPoints& points, scattering::Bsdf* out) const final;
  bool needs_differentials() const final { return varies_ || !detail_.is_flat(); }
  std::optional<scattering::Bsdf> constant() const final { return detail_.is_flat() ? constant_ : std::nullopt; }
  float work() const final { return input_work_ + detail_.work(); }

 protected:
  explicit SurfaceMaterial(SurfaceDetail detail) : detail_(std::move(detail)) {}
  const SurfaceDetail& detail() const { return detail_; }
  /// The last act of a subclass's constructor: if no input varies, scatter() is asked once and for all. `work`:
  /// Texture::work of all inputs.
  void settle(bool inputs_constant, float work);

 private:
  /// Writes out[0, points.count), the frame apart.
  virtual void scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const = 0;
  /// What needs the frames, which are known by then; of materials that vary.
  virtual void finish(const pattern::ShadingPoints&, scattering::Bsdf*) const {}

  SurfaceDetail detail_;
  bool varies_ = true;
  float input_work_ = pattern::unknown_work;
  std::optional<scattering::Bsdf> constant_;
};

}  // namespace dapple::shading
