// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/scene/light_groups.h"
#include "dapple/scenefile/scene_description.h"

namespace dapple::build {

/// The group that a LightSource or AreaLightSource names (`"string group"`), added to the groups where it is new.
/// InputError for a name that cannot be that of a layer, and for more groups than there may be.
uint8_t read_light_group(const scenefile::Entity& light, scene::LightGroups* groups);

}  // namespace dapple::build
