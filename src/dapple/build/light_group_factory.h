// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/build/build_context.h"
#include "dapple/scene/light_groups.h"
#include "dapple/scenefile/scene_description.h"

namespace dapple::build {

/// The group that a LightSource or AreaLightSource names (`"string group"`), added to the groups where it is new.
/// InputError for a name that cannot be that of a layer, and for more groups than there may be.
uint8_t read_light_group(const scenefile::Entity& light, scene::LightGroups* groups);

inline constexpr double most_gain = 1e9;

/// What is said of a group's gain in place of the scene, as on a command line.
struct GainOverride {
  std::string group;
  RGB gain;
};

/// Gains of the groups by LightGroup (`"float gain"` or `"rgb gain"`), then by overrides. InputError for what is no
/// gain, from 0 to 1e9; UsageError for an override of a group that there is not.
std::vector<RGB> read_gains(const BuildContext& context, const scene::LightGroups& groups,
                            const std::vector<GainOverride>& overrides);

}  // namespace dapple::build
