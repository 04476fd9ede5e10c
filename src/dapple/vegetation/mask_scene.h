// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "dapple/forest/mask_visibility.h"
#include "dapple/integrate/integrator.h"
#include "dapple/scene/scene.h"

namespace dapple::vegetation {

/// What casts shadows in a scene, as facets for shadow masks: meshes and grids as they are, quadrics in 64 x 32 facets,
/// disks of clouds as hexagons of equal area, curves as ribbons that face the light. Surfaces that only separate media
/// are left out; what moves stands as in the middle of the shutter interval. Alpha by the scene's textures; on clouds
/// of disks and curves only where it is the same everywhere. The scene must outlive it. MemoryError beyond max_bytes.
std::unique_ptr<const forest::FacetScene> make_mask_scene(const scene::Scene& scene, size_t max_bytes);

/// The state of masks' tiles, for statistics, their counts included.
integrate::CacheState mask_cache(const forest::MaskVisibility& masks);

/// The narrow beams of its lights: what masks are made for. Equal ones once.
std::vector<emitters::NarrowBeam> narrow_beams(const scene::Scene& scene);

}  // namespace dapple::vegetation
