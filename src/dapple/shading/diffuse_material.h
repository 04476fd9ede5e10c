// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/shading/surface_material.h"

namespace dapple::shading {

/// Lambertian reflection; reflectance is clamped to [0, 1].
class DiffuseMaterial final : public SurfaceMaterial {
 public:
  DiffuseMaterial(pattern::Input<RGB> reflectance, SurfaceDetail detail);
  bool is_diffuse() const override { return true; }

 private:
  void scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const override;
  pattern::Input<RGB> reflectance_;
};

/// Lambertian reflection and transmission (leaves, paper). Both are scaled, then clamped to [0, 1]; their sum is the
/// user's care.
class DiffuseTransmissionMaterial final : public SurfaceMaterial {
 public:
  DiffuseTransmissionMaterial(pattern::Input<RGB> reflectance, pattern::Input<RGB> transmittance, float scale,
                              SurfaceDetail detail);
  bool is_diffuse() const override { return true; }
  bool is_translucent() const override { return true; }

 private:
  void scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const override;
  pattern::Input<RGB> reflectance_, transmittance_;
  float scale_;
};

}  // namespace dapple::shading
