// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/light.h"

namespace dapple::shading {

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
