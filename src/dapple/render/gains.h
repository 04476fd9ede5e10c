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
/// know no groups, estimates of noise. Empty: nothing is.
std::string why_no_gains(const GainUse& use);
/// UsageError with that, if some gain is not 1.
void check_gains(const std::vector<RGB>& gains, const GainUse& use);

/// How far back other gains change what was rendered.
enum class GainReach : uint8_t {
  sums,     ///< of the film, which are weighted by them
  samples,  ///< too: shaders have stages that make of light what the viewer sees
  stored,   ///< light too: shaders have stages that make of it what other surfaces receive
};
/// By the stages that integrators of this type run.
GainReach reach_of_gains(const scene::Scene& scene, const std::string& integrator_type);

}  // namespace dapple::render
