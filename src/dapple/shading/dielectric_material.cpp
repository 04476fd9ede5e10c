// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/dielectric_material.h"

namespace dapple::shading {

DielectricMaterial::DielectricMaterial(float ior, RoughnessInput roughness, SurfaceDetail detail)
    : SurfaceMaterial(std::move(detail)), ior_(ior), roughness_(std::move(roughness)) {
  settle(pattern::all_constant(roughness_.u, roughness_.v), pattern::total_work(roughness_.u, roughness_.v));
}

void DielectricMaterial::scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const {
  const pattern::InputValues<float> u(roughness_.u, points), v(roughness_.v, points);
  for (int i = 0; i < points.count; ++i)
    out[i] = scattering::Bsdf::make_dielectric(ior_, roughness_.alpha(u[i]), roughness_.alpha(v[i]));
}

ThinDielectricMaterial::ThinDielectricMaterial(float ior, SurfaceDetail detail)
    : SurfaceMaterial(std::move(detail)), ior_(ior) {
  settle(true, 0);
}

void ThinDielectricMaterial::scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const {
  std::fill_n(out, points.count, scattering::Bsdf::make_thin_dielectric(ior_));
}

}  // namespace dapple::shading
