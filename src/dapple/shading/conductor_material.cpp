// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/conductor_material.h"

#include "dapple/scattering/fresnel.h"

namespace dapple::shading {

void MetalInput::Values::get(int i, RGB* eta, RGB* k) const {
  const RGB first = first_[i];
  if (by_reflectance_) {
    *eta = RGB(1);
    *k = {conductor_k_from_reflectance(first.r), conductor_k_from_reflectance(first.g),
          conductor_k_from_reflectance(first.b)};
  } else {
    *eta = first;
    *k = second_[i];
  }
  *eta *= scale_;
  *k *= scale_;
}

ConductorMaterial::ConductorMaterial(MetalInput metal, RoughnessInput roughness, SurfaceDetail detail)
    : SurfaceMaterial(std::move(detail)), metal_(std::move(metal)), roughness_(std::move(roughness)) {
  settle(metal_.is_constant() && pattern::all_constant(roughness_.u, roughness_.v),
         metal_.work() + pattern::total_work(roughness_.u, roughness_.v));
}

void ConductorMaterial::scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const {
  const MetalInput::Values metal(metal_, points);
  const pattern::InputValues<float> u(roughness_.u, points), v(roughness_.v, points);
  RGB eta, k;
  for (int i = 0; i < points.count; ++i) {
    metal.get(i, &eta, &k);
    out[i] = scattering::Bsdf::make_conductor(eta, k, roughness_.alpha(u[i]), roughness_.alpha(v[i]));
  }
}

}  // namespace dapple::shading
