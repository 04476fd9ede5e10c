// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/light_group_factory.h"

#include <algorithm>
#include <cctype>

namespace dapple::build {

namespace {
constexpr size_t longest_name = 64;

bool is_layer_name(const std::string& name) {
  return !name.empty() && name.size() <= longest_name &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; });
}
}  // namespace

uint8_t read_light_group(const scenefile::Entity& light, scene::LightGroups* groups) {
  const scenefile::Param* p = light.params.find("group");
  if (!p) return 0;
  const std::string name = light.params.get_string("group", "");
  if (!is_layer_name(name))
    throw InputError(p->loc, "\"group\" is \"" + name + "\"; expected 1 to " + std::to_string(longest_name) +
                                 " letters, digits, - and _");
  const auto at = std::find(groups->names.begin(), groups->names.end(), name);
  if (at == groups->names.end()) {
    if (groups->names.size() == scene::LightGroups::max_count)
      throw InputError(p->loc, "light group \"" + name + "\" is one too many; expected at most " +
                                   std::to_string(scene::LightGroups::max_count) + " groups, \"default\" included");
    groups->names.push_back(name);
    return uint8_t(groups->names.size() - 1);
  }
  return uint8_t(at - groups->names.begin());
}

}  // namespace dapple::build
