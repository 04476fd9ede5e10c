// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/error.h"
#include "dapple/modelfile/model.h"
#include "dapple/scenefile/description_builder.h"

namespace dapple::modelfile {

/// Lumens a watt at 555 nm: candela and lux of glTF become W/sr and W/m^2 by it, as Blender's importer has it.
inline constexpr float lumens_a_watt = 683;

/// Adds the lights of a model, and says how many. Those of glTF have physical units. Other formats have none, and no
/// agreement on how light falls off: there a light, inverse-square, gives a white surface that faces it in the middle
/// of the model the radiance of its colour, at most 1 (an area light ten times that on its own face).
size_t emit_lights(const Model& model, const FileLoc& loc, scenefile::DescriptionBuilder* builder);

}  // namespace dapple::modelfile
