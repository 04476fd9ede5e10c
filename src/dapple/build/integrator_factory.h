// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "dapple/build/integrator_request.h"
#include "dapple/gi/opacity_cache.h"
#include "dapple/integrate/integrator.h"

namespace dapple::build {

/// The cache of opacity that the scene's rays will use from now on, a share of the request's memory; null if nothing is
/// cut out, or if the request says so. The scene must outlive it.
std::unique_ptr<gi::OpacityCache> make_opacity_cache(scene::Scene& scene, const IntegratorRequest& request);

/// What integrators find out of a scene before rendering and owe to no light: one for the same scene, camera, request,
/// samples and seed under other lights takes it over. Not where media scatter, which light reaches by tables of its
/// own.
struct Preparations {
  std::shared_ptr<const distribution::SurveyedReaders> readers;
  std::shared_ptr<const std::vector<light::LightPoint>> light_points;
};

/// Makes the integrator asked for; presets fill in what the request leaves open. The scene must outlive it.
/// `pixel_samples`: that will be taken, 0 if that is open. InputError for a canopy that the scene has not, and
/// for what images of trees cannot show. `stop`: of learning lights and of surveys, which throw Stopped. `known`: used,
/// and what it lacks filled in; null: nothing is known.
std::unique_ptr<const integrate::Integrator> make_integrator(const scene::Scene& scene,
                                                             const IntegratorRequest& request, int pixel_samples,
                                                             uint64_t seed, StopToken stop = {},
                                                             Preparations* known = nullptr);

}  // namespace dapple::build
