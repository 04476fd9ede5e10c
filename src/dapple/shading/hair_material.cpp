// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/hair_material.h"

#include <algorithm>

namespace dapple::shading {

namespace {

RGB not_negative(RGB c) {
  const auto clean = [](float v) { return v > 0 ? std::min(v, 1e6f) : 0; };
  return {clean(c.r), clean(c.g), clean(c.b)};
}

}  // namespace

float HairInputs::work() const {
  constexpr float own = 100;
  const float pigments = pattern::total_work(eumelanin, pheomelanin);
  return own + pattern::total_work(eta, beta_m, beta_n, alpha) +
         (sigma_a ? pattern::total_work(*sigma_a)
          : color ? pattern::total_work(*color)
                  : pigments);
}

HairMaterial::HairMaterial(HairInputs inputs) : SurfaceMaterial(SurfaceDetail{}), in_(std::move(inputs)) {
  settle(false, in_.work());
}

void HairMaterial::scatter(const pattern::ShadingPoints& points, scattering::Bsdf* out) const {
  const pattern::InputValues<float> eta(in_.eta, points), beta_m(in_.beta_m, points), beta_n(in_.beta_n, points),
      tilt(in_.alpha, points);
  scattering::HairFibre f[pattern::ShadingPoints::capacity];
  for (int i = 0; i < points.count; ++i) {
    const float sign = dot(cross(points.Ns[i], points.dPdu[i]), points.dPdv[i]) < 0 ? -1.0f : 1.0f;
    f[i].h = sign * std::clamp(2 * points.v[i] - 1, -0.9999f, 0.9999f);
    f[i].eta = std::clamp(eta[i], 1.0001f, 10.0f);
    f[i].beta_m = std::clamp(beta_m[i], 0.0f, 1.0f);
    f[i].beta_n = std::clamp(beta_n[i], 0.0f, 1.0f);
    f[i].tilt = tilt[i];
  }
  if (in_.sigma_a) {
    const pattern::InputValues<RGB> sigma_a(*in_.sigma_a, points);
    for (int i = 0; i < points.count; ++i) f[i].sigma_a = not_negative(sigma_a[i]);
  } else if (in_.color) {
    const pattern::InputValues<RGB> color(*in_.color, points);
    for (int i = 0; i < points.count; ++i) f[i].sigma_a = scattering::hair_absorption(color[i], f[i].beta_n);
  } else {
    const pattern::InputValues<float> eumelanin(in_.eumelanin, points), pheomelanin(in_.pheomelanin, points);
    for (int i = 0; i < points.count; ++i)
      f[i].sigma_a = not_negative(scattering::hair_absorption(eumelanin[i], pheomelanin[i]));
  }
  for (int i = 0; i < points.count; ++i) out[i] = f[i].bsdf();
}

}  // namespace dapple::shading
