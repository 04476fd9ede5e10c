// SPDX-License-Identifier: Apache-2.0
#include "dapple/emitters/light.h"

#include "dapple/numeric/warp.h"

namespace dapple::emitters {

V3f LightReceiver::draw_by_cosine(const V2f& u) const {
  if (n == V3f(0, 0, 0)) return square_to_sphere(u);
  V2f v = u;
  const bool below = transmits && u.x >= 0.5f;
  if (transmits) v.x = below ? 2 * u.x - 1 : 2 * u.x;
  V3f local = square_to_cosine_hemisphere(v);
  if (below) local.z = -local.z;
  return Frame(n).to_world(local);
}

float LightReceiver::cosine_pdf(const V3f& wi) const {
  if (n == V3f(0, 0, 0)) return sphere_pdf;
  const float cosine = dot(n, wi);
  return transmits ? cosine_hemisphere_pdf(std::abs(cosine)) / 2 : cosine_hemisphere_pdf(cosine);
}

uint32_t Light::sample_all(const LightReceiver& to, std::span<const V2f> u, LightSample* out) const {
  uint32_t drawn = 0;
  for (size_t i = 0; i < u.size(); ++i) drawn |= uint32_t(sample(to, u[i], &out[i])) << i;
  return drawn;
}

RGB Light::emitted(const V3f&, const V3f&, const V2f&, const V3f&) const {
  return {};
}

RGB Light::environment(const V3f&, float) const {
  return {};
}

RGB Light::environment_at(const V3f&, const V3f& wi, float dwi) const {
  return environment(wi, dwi);
}

}  // namespace dapple::emitters
