// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/group_names.h"

#include <set>
#include <string_view>

namespace dapple::scenefile {

namespace {

// Without counting the parameter as used.
const Param* parameter(const ParamSet& params, std::string_view name) {
  for (const ParamSet* set : {&params, params.defaults().get()})
    if (set)
      for (const Param& p : set->all())
        if (p.name == name) return &p;
  return nullptr;
}

/// In the order in which they come up.
struct Names {
  std::vector<std::string> all;
  std::set<std::string> known;
  void add(const std::string& name) {
    if (known.insert(name).second) all.push_back(name);
  }
};

Names names_of_lights(const SceneDescription& description) {
  Names names;
  names.add(default_group);
  const auto add_light = [&](const Entity& light) {
    const Param* const group = light.presence == Presence::removed ? nullptr : parameter(light.params, "group");
    if (group && group->strings.size() == 1) names.add(group->strings[0]);
  };
  for (const LightEntity& light : description.lights) add_light(light);
  for (const Entity& light : description.area_lights) add_light(light);
  return names;
}

}  // namespace

std::vector<std::string> lit_groups(const SceneDescription& description) {
  return names_of_lights(description).all;
}

std::vector<std::string> group_names(const SceneDescription& description) {
  Names names = names_of_lights(description);
  for (const LightGroupEntity& group : description.light_groups)
    if (!group.params.empty()) names.add(group.name);
  return names.all;
}

}  // namespace dapple::scenefile
