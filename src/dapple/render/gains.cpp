// SPDX-License-Identifier: Apache-2.0
#include "dapple/render/gains.h"

#include <algorithm>

#include "dapple/base/error.h"

namespace dapple::render {

std::string why_no_gains(const GainUse& use) {
  const build::IntegratorRequest& r = use.request;
  if (r.type != "path" && r.type != "distribution")
    return "they go with integrators path and distribution, not " + r.type;
  if (use.noise_target > 0) return "a noise target is judged by samples, which do not know of them";
  for (const char* aov : {"variance", "error", "airlight", "direct"})
    if (std::find(use.aovs.begin(), use.aovs.end(), aov) != use.aovs.end())
      return "layer " + std::string(aov) + " is not known by groups";
  return "";
}

std::string why_no_gains(const scene::Scene& scene, const GainUse& use) {
  using shading::Stage;
  if (const std::string why = why_no_gains(use); !why.empty() || use.request.type != "distribution") return why;
  for (const shading::MaterialPtr& material : scene.materials)
    for (const Stage stage : {Stage::diffuselighting, Stage::specularlighting, Stage::postlighting})
      if (material->stages().has(stage))
        return "a shader has a stage " + std::string(shading::stage_names[size_t(stage)]) +
               " of its own, and what it makes of light need not be a sum of what it makes of each group's";
  return "";
}

void check_gains(const scene::Scene* scene, const std::vector<RGB>& gains, const GainUse& use) {
  if (std::all_of(gains.begin(), gains.end(), [](const RGB& gain) { return gain == RGB(1); })) return;
  const std::string why = scene ? why_no_gains(*scene, use) : why_no_gains(use);
  if (!why.empty()) throw UsageError("gains of light groups: " + why);
}

}  // namespace dapple::render
