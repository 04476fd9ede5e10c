// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/light.h"

namespace dapple::shading {

RGB Light::emitted(const V3f&, const V3f&, const V2f&, const V3f&) const {
  return {};
}

RGB Light::environment(const V3f&, float) const {
  return {};
}

}  // namespace dapple::shading
