// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/material.h"

namespace dapple::shading {

void Material::displacement(const pattern::ShadingPoints& points, V3f* P) const {
  for (int i = 0; i < points.count; ++i) P[i] = points.P[i];
}

void Material::opacity(const pattern::ShadingPoints& points, RGB* Oi) const {
  std::fill_n(Oi, points.count, RGB(1));
}

void Material::flat_prelighting(const pattern::ShadingPoints& points, scattering::Bsdf* out) const {
  prelighting(points, out);
  for (int i = 0; i < points.count; ++i) out[i].flatten();
}

void Material::diffuselighting(const DiffuseLighting& in) const {
  for (int i = 0; i < in.points.count; ++i)
    in.diffuse[i] = lambertian_radiance(in.bsdf[i], in.irradiance[i], in.irradiance_behind[i]);
}

void Material::specularlighting(const SpecularLighting& in) const {
  for (int i = 0; i < in.points.count; ++i) in.Ci[i] = in.diffuse[i] + in.specular[i];
}

void Material::postlighting(const PostLighting&) const {}

}  // namespace dapple::shading
