// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "dapple/build/texture_factory.h"
#include "dapple/media/medium.h"

namespace dapple::build {

/// A MakeNamedMedium directive, with pbrt-v4's parameters and units (docs/guide/lights.md). Types homogeneous,
/// uniformgrid, rgbgrid, cloud, nanovdb and our own pattern and exponential. Unknown types and presets, coefficients
/// that are negative or not finite, grids of the wrong size, and volumes that cannot be read throw InputError; unused
/// parameters are reported. Never null.
std::shared_ptr<const media::Medium> make_medium(const scenefile::MediumEntity& entity, const BuildContext& context,
                                                 const TextureLibrary& textures);

/// All media of the description, in its order.
std::vector<std::shared_ptr<const media::Medium>> make_media(const BuildContext& context,
                                                             const TextureLibrary& textures);

}  // namespace dapple::build
