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

void check_gains(const std::vector<RGB>& gains, const GainUse& use) {
  if (std::all_of(gains.begin(), gains.end(), [](const RGB& gain) { return gain == RGB(1); })) return;
  if (const std::string why = why_no_gains(use); !why.empty()) throw UsageError("gains of light groups: " + why);
}

GainReach reach_of_gains(const scene::Scene& scene, const std::string& integrator_type) {
  using shading::Stage;
  if (integrator_type != "distribution") return GainReach::sums;
  const auto any_has = [&](Stage stage) {
    return std::any_of(scene.materials.begin(), scene.materials.end(),
                       [stage](const auto& material) { return material->stages().has(stage); });
  };
  if (any_has(Stage::diffuselighting)) return GainReach::stored;
  return any_has(Stage::specularlighting) || any_has(Stage::postlighting) ? GainReach::samples : GainReach::sums;
}

}  // namespace dapple::render
