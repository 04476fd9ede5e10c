// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "dapple/scenefile/scene_description.h"

namespace dapple::scenefile {

/// The group of lights that takes those that name none.
inline constexpr const char* default_group = "default";

/// Groups by which lights and area lights that are not removed go (`"string group"`), and those of which LightGroup
/// says something: default first, then in the order in which they come up.
std::vector<std::string> group_names(const SceneDescription& description);
/// The former alone.
std::vector<std::string> lit_groups(const SceneDescription& description);

}  // namespace dapple::scenefile
