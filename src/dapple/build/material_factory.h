// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/build/texture_factory.h"
#include "dapple/shading/material.h"

namespace dapple::build {

/// The materials of context.description, in its order (docs/guide/materials.md). Unknown types, mixes of missing or of
/// themselves and impossible values throw InputError; values out of range are clamped with a warning; unused parameters
/// are reported.
std::vector<shading::MaterialPtr> make_materials(const BuildContext& context, const TextureLibrary& textures);
/// One of them.
shading::MaterialPtr make_material(const BuildContext& context, const TextureLibrary& textures,
                                   scenefile::MaterialIndex index);

}  // namespace dapple::build
