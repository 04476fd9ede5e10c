// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>

#include "dapple/base/stop_token.h"
#include "dapple/emitters/learned_lights.h"
#include "dapple/integrate/ray_tracer.h"

namespace dapple::light {

/// A place where light samples are wanted.
struct LightPoint {
  emitters::LightReceiver to;
  V3f Ng{0, 0, 0};  ///< of the surface; 0 in media
  float error = 0;  ///< geom::SurfacePoint::error
  uint32_t geometry = trace::no_id;
  int32_t medium = scene::vacuum;  ///< in which rays leave, unless the surface says otherwise
};

/// There is something to choose: several lights, or a sky of which a part may be hidden.
bool pays_to_learn(const scene::Scene& scene);

/// Learns, by a fixed number of shadow rays from each of the points, what reaches each region of the scene. After
/// Vevoda, Kondapaneni and Krivanek 2018 ("Bayesian online regression for adaptive direct illumination sampling")
/// lights are to be drawn in proportion to the root of their mean square contribution over a region, where regions with
/// few samples lean on those around; unlike there, all is learned beforehand, so that images depend neither on threads
/// nor on the order of pixels. A function of its arguments. May throw Stopped.
std::shared_ptr<const emitters::LearnedLights> learn_lights(const scene::Scene& scene,
                                                            const integrate::RayTracer& tracer,
                                                            std::span<const LightPoint> points, uint64_t seed,
                                                            StopToken stop = {});

}  // namespace dapple::light
