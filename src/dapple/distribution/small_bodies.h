// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "dapple/scene/scene.h"

namespace dapple::distribution {

/// By geometry of the scene, whether it is of a subsurface body too small for diffusion, which takes the surface around
/// a point for the plane of a body without end: its reach is below SubsurfaceNumbers::least_reach free paths
/// (docs/design/012). A body is what one object, or the scene itself, has of one material, and its reach is half its
/// longest side where it is placed largest. Of materials that differ from point to point, and of what is placed in
/// objects, nothing is known: these count as large.
std::vector<uint8_t> find_small_bodies(const scene::Scene& scene);

}  // namespace dapple::distribution
