// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/infinite_light.h"

#include "dapple/numeric/warp.h"

namespace dapple::shading {

bool InfiniteLight::sample(const LightReceiver& to, const V2f& u, LightSample* out) const {
  V3f wi;
  if (to.n == V3f(0, 0, 0)) {
    wi = square_to_sphere(u);
  } else {
    V2f v = u;
    const bool below = to.transmits && u.x >= 0.5f;
    if (to.transmits) v.x = below ? 2 * u.x - 1 : 2 * u.x;
    V3f local = square_to_cosine_hemisphere(v);
    if (below) local.z = -local.z;
    wi = Frame(to.n).to_world(local);
  }
  *out = {.wi = wi, .distance = infinity, .radiance = radiance_, .pdf = pdf(to, wi, wi, wi), .delta = false};
  return out->pdf > 0 && !radiance_.is_black();
}

float InfiniteLight::pdf(const LightReceiver& to, const V3f& wi, const V3f&, const V3f&) const {
  if (to.n == V3f(0, 0, 0)) return sphere_pdf;
  const float cos_theta = dot(to.n, wi);
  return to.transmits ? cosine_hemisphere_pdf(std::abs(cos_theta)) / 2 : cosine_hemisphere_pdf(cos_theta);
}

}  // namespace dapple::shading
