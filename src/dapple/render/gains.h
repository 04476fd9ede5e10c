// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "dapple/build/integrator_factory.h"
#include "dapple/scene/scene.h"

namespace dapple::render {

/// What a picture is to show that may not go with gains of light groups.
struct GainUse {
  const build::IntegratorRequest& request;  ///< over the scene's
  const std::vector<std::string>& aovs;
  double noise_target = 0;
};

/// Light of groups adds up, and so gains are factors on sums. Says what of a picture is no such sum: integrators that
/// know no groups, shaders with stages of their own, estimates of noise. Empty: nothing is.
std::string why_no_gains(const scene::Scene& scene, const GainUse& use);
/// The same by what is asked for alone.
std::string why_no_gains(const GainUse& use);
/// UsageError with that, if some gain is not 1. Null: of a scene whose materials are not known yet.
void check_gains(const scene::Scene* scene, const std::vector<RGB>& gains, const GainUse& use);

}  // namespace dapple::render
