// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/build/integrator_request.h"
#include "dapple/path/path_integrator.h"

namespace dapple::build {

/// The transport of a scene's canopy, with the plot and slabs of the request. std::invalid_argument where there is
/// none.
std::shared_ptr<const vegetation::CanopyTransport> solve_canopy(const scene::Scene& scene, const IntegratorRequest& r);

/// A solved canopy for PathIntegrator::Settings::leaf_answers, set right by paths of `paths`, which traces what the
/// answers stand for. `pixel_samples`: that will be taken. Null, unless the request asks for it, where diffuse rays
/// meet few leaves, where the image is too small to pay for it, and where the paths say that the image would be off by
/// more than LeafNumbers::most_error. Null too, with a warning if it is asked for, where there is no canopy, or where
/// lights stand in the scene or are in groups. May throw Stopped.
std::shared_ptr<const vegetation::CanopyTransport> make_leaf_answers(const scene::Scene& scene,
                                                                     const IntegratorRequest& request,
                                                                     const path::PathIntegrator& paths,
                                                                     int pixel_samples, StopToken stop);

}  // namespace dapple::build
