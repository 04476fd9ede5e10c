// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/diffuse_material.h"

namespace dapple::shading {

DiffuseMaterial::DiffuseMaterial(pattern::Input<RGB> reflectance, SurfaceDetail detail)
    : SurfaceMaterial(std::move(detail)), reflectance_(std::move(reflectance)) {
  settle(pattern::all_constant(reflectance_), pattern::total_work(reflectance_));
}

void DiffuseMaterial::scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const {
  const pattern::InputValues<RGB> reflectance(reflectance_, points);
  for (int i = 0; i < points.count; ++i) out[i] = scattering::Bsdf::make_diffuse(clamp(reflectance[i], 0, 1));
}

DiffuseTransmissionMaterial::DiffuseTransmissionMaterial(pattern::Input<RGB> reflectance,
                                                         pattern::Input<RGB> transmittance, float scale,
                                                         SurfaceDetail detail)
    : SurfaceMaterial(std::move(detail)),
      reflectance_(std::move(reflectance)),
      transmittance_(std::move(transmittance)),
      scale_(scale) {
  settle(pattern::all_constant(reflectance_, transmittance_), pattern::total_work(reflectance_, transmittance_));
}

void DiffuseTransmissionMaterial::scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const {
  const pattern::InputValues<RGB> reflectance(reflectance_, points), transmittance(transmittance_, points);
  for (int i = 0; i < points.count; ++i)
    out[i] = scattering::Bsdf::make_diffuse_transmission(clamp(scale_ * reflectance[i], 0, 1),
                                                         clamp(scale_ * transmittance[i], 0, 1));
}

}  // namespace dapple::shading
