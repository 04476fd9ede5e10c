// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "dapple/build/texture_factory.h"
#include "dapple/emitters/light.h"

namespace dapple::build {

/// LightSource "canopy", sun and sky through a mask of leaves, and "sky", the same without it (docs/guide/lights.md).
std::unique_ptr<emitters::Light> make_canopy_light(const scenefile::LightEntity& entity,
                                                   const Transform& light_to_world, const BuildContext& context,
                                                   const TextureLibrary& textures);

}  // namespace dapple::build
