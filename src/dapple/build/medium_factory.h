// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "dapple/build/texture_factory.h"
#include "dapple/media/medium.h"

namespace dapple::build {

/// A MakeNamedMedium directive, with pbrt-v4's parameters and units (docs/guide/lights.md). Types homogeneous,
/// uniformgrid, rgbgrid and our own pattern; cloud and nanovdb become empty space, named as unsupported. Unknown types
/// and presets, coefficients that are negative or not finite, and grids of the wrong size throw InputError; unused
/// parameters are reported. Never null.
std::shared_ptr<const media::Medium> make_medium(const scenefile::MediumEntity& entity, const BuildContext& context,
                                                 const TextureLibrary& textures);

/// All media of the description, in its order.
std::vector<std::shared_ptr<const media::Medium>> make_media(const BuildContext& context,
                                                             const TextureLibrary& textures);

}  // namespace dapple::build
