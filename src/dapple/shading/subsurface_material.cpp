// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/subsurface_material.h"

namespace dapple::shading {

namespace {

constexpr float largest = 1e12f;  // 1/m: beyond, products overflow

float clean(float v) {
  return v > 0 ? std::min(v, largest) : 0;
}

}  // namespace

SubsurfaceMaterial::SubsurfaceMaterial(float ior, RoughnessInput roughness, InteriorInput interior,
                                       SurfaceDetail detail)
    : SurfaceMaterial(std::move(detail)),
      ior_(ior),
      roughness_(std::move(roughness)),
      interior_(std::move(interior)),
      table_(double(ior), double(interior_.g)) {
  settle(pattern::all_constant(roughness_.u, roughness_.v) && interior_.is_constant(),
         pattern::total_work(roughness_.u, roughness_.v) + interior_.work());
}

void SubsurfaceMaterial::scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const {
  const pattern::InputValues<float> u(roughness_.u, points), v(roughness_.v, points);
  const auto write = [&](const pattern::Input<RGB>& first, const pattern::Input<RGB>& second, const auto& make) {
    const pattern::InputValues<RGB> a(first, points), b(second, points);
    for (int i = 0; i < points.count; ++i) out[i] = make(a[i], b[i], roughness_.alpha(u[i]), roughness_.alpha(v[i]));
  };
  if (interior_.reflectance)
    write(*interior_.reflectance, interior_.mean_free_path, [this](auto... x) { return from_reflectance(x...); });
  else
    write(interior_.sigma_a, interior_.sigma_s, [this](auto... x) { return from_coefficients(x...); });
}

scattering::Bsdf SubsurfaceMaterial::from_coefficients(RGB sigma_a, RGB sigma_s, float alpha_x, float alpha_y) const {
  RGB sigma_t, albedo;
  std::array<HalfSpaceTable::Entry, 3> inside;
  for (int c = 0; c < 3; ++c) {
    const float a = clean(sigma_a[c] * interior_.scale), s = clean(sigma_s[c] * interior_.scale);
    sigma_t[c] = a + s;
    albedo[c] = sigma_t[c] > 0 ? s / sigma_t[c] : 0;
    inside[size_t(c)] = table_.at(albedo[c]);
  }
  return scattering::Bsdf::make_subsurface(ior_, alpha_x, alpha_y, sigma_t, albedo, interior_.g, inside);
}

scattering::Bsdf SubsurfaceMaterial::from_reflectance(RGB reflectance, RGB mean_free_path, float alpha_x,
                                                      float alpha_y) const {
  RGB sigma_t, albedo;
  std::array<HalfSpaceTable::Entry, 3> inside;
  for (int c = 0; c < 3; ++c) {
    const float share = reflectance[c] > 0 ? std::min(reflectance[c], 1.0f) : 0;
    sigma_t[c] = clean(1 / (mean_free_path[c] * interior_.scale));
    albedo[c] = table_.albedo(share);
    inside[size_t(c)] = table_.at(albedo[c]);
    inside[size_t(c)].reflectance = share;
  }
  return scattering::Bsdf::make_subsurface(ior_, alpha_x, alpha_y, sigma_t, albedo, interior_.g, inside);
}

}  // namespace dapple::shading
