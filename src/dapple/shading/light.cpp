// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/light.h"

namespace dapple::shading {

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

}  // namespace dapple::shading
