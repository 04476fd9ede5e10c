// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "dapple/build/texture_factory.h"
#include "dapple/emitters/area_light.h"
#include "dapple/emitters/light.h"
#include "dapple/geom/emitter_shape.h"
#include "dapple/trace/traced_scene.h"

namespace dapple::build {

// Lights from their directives, with pbrt-v4's parameters and units (docs/guide/lights.md). Unknown types, missing
// files and emission that is negative or not finite throw InputError; unused parameters are reported.

/// A LightSource, here also those of the forest (canopy_light_factory.h). Null if it emits nothing.
std::unique_ptr<emitters::Light> make_light(const scenefile::LightEntity& entity, const BuildContext& context,
                                            const TextureLibrary& textures);

/// The primitives of a shape as emitters, in the order of their numbers and with the side that SurfacePoint::Ng points
/// to; nullopt for those without area. Empty for curves. Deforming meshes are taken at shutter open.
std::vector<std::optional<geom::EmitterShape>> make_emitters(const trace::Shape& shape);
/// The same, but for two consecutive triangles that are a rectangle: these are one emitter. (*emitter_of)[primitive] is
/// the place of its emitter. For emission that is the same all over.
std::vector<std::optional<geom::EmitterShape>> make_joined_emitters(const trace::Shape& shape,
                                                                    std::vector<uint32_t>* emitter_of);

/// The lights of an AreaLightSource on one shape, one for each emitter: null where there is no emitter or no emission.
/// Emitters without area are named in a warning. `alpha`: the shape's opacity, may be null. `motion`: of the shape,
/// whose emitters are as at shutter open; null where it is still. `loc`: of the shape.
std::vector<std::unique_ptr<emitters::Light>> make_area_lights(const scenefile::Entity& entity,
                                                               std::vector<std::optional<geom::EmitterShape>> emitters,
                                                               const pattern::FloatTexturePtr& alpha,
                                                               std::shared_ptr<const emitters::LightMotion> motion,
                                                               const BuildContext& context,
                                                               const TextureLibrary& textures, const FileLoc& loc);

}  // namespace dapple::build
