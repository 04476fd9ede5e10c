// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "dapple/light/shaft_light.h"

namespace dapple::light {

/// Says whether planes apply to a scene, which lights they have, how many planes and bins, and has their tables filled.
/// Null where planes do not apply; then `why` says what stands against them. `left`: what is left to rays although
/// planes apply, and how many planes memory does not hold. The scene must outlive it.
std::shared_ptr<const ShaftLight> make_shaft_light(const scene::Scene& scene, const ShaftSettings& settings,
                                                   std::string* why, std::vector<std::string>* left);

}  // namespace dapple::light
