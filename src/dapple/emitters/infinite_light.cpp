// SPDX-License-Identifier: Apache-2.0
#include "dapple/emitters/infinite_light.h"

namespace dapple::emitters {

bool InfiniteLight::sample(const LightReceiver& to, const V2f& u, LightSample* out) const {
  const V3f wi = to.draw_by_cosine(u);
  *out = {.wi = wi, .distance = infinity, .radiance = radiance_, .pdf = to.cosine_pdf(wi), .delta = false};
  return out->pdf > 0 && !radiance_.is_black();
}

float InfiniteLight::pdf(const LightReceiver& to, const V3f& wi, const V3f&, const V3f&) const {
  return to.cosine_pdf(wi);
}

}  // namespace dapple::emitters
