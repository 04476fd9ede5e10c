// SPDX-License-Identifier: Apache-2.0
#include "dapple/emitters/distant_light.h"

namespace dapple::emitters {

bool DistantLight::sample(const LightReceiver&, const V2f&, LightSample* out) const {
  *out = {.wi = to_light_, .distance = infinity, .radiance = irradiance_, .pdf = 1, .delta = true};
  return !irradiance_.is_black();
}

}  // namespace dapple::emitters
