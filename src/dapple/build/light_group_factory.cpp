// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/light_group_factory.h"

#include <algorithm>
#include <cctype>

#include "dapple/build/spectrum_params.h"
#include "dapple/scenefile/group_names.h"

namespace dapple::build {

namespace {
constexpr size_t longest_name = 64;

bool is_layer_name(const std::string& name) {
  return !name.empty() && name.size() <= longest_name &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; });
}

RGB read_gain(const scenefile::Param& p, const BuildContext& context) {
  const RGB gain =
      p.type == scenefile::ParamType::real && p.numbers.size() == 1 ? RGB(p.numbers[0]) : illuminant_rgb(p, context);
  if (!gain.is_finite() || !(gain.min() >= 0) || !(gain.max() <= float(most_gain)))
    throw InputError(p.loc, "\"gain\" of a light group must be from 0 to 1e9");
  return gain;
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

std::vector<RGB> read_gains(const BuildContext& context, const scene::LightGroups& groups,
                            const std::vector<GainOverride>& overrides) {
  std::vector<RGB> gains(groups.names.size(), RGB(1));
  const auto set = [&](const std::string& name, const RGB& gain) {
    const auto at = std::find(groups.names.begin(), groups.names.end(), name);
    if (at != groups.names.end()) gains[size_t(at - groups.names.begin())] = gain;
    return at != groups.names.end();
  };
  std::vector<std::string> known;  // those of lights that are off too
  for (const scenefile::LightGroupEntity& g : context.description.light_groups) {
    const scenefile::Param* const p = g.params.find("gain");
    if (!p) continue;
    const RGB gain = read_gain(*p, context);
    if (set(g.name, gain)) continue;
    if (known.empty()) known = scenefile::lit_groups(context.description);
    if (std::find(known.begin(), known.end(), g.name) == known.end())
      context.diagnostics.warn(g.loc, "no light is of the group \"" + g.name + "\", which has a gain", "gain");
  }
  for (const GainOverride& o : overrides) {
    if (set(o.group, o.gain)) continue;
    throw UsageError("no light is of the group \"" + o.group + "\"; " +
                     one_of(std::vector<std::string_view>(groups.names.begin(), groups.names.end())));
  }
  return gains;
}

}  // namespace dapple::build
