// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/error.h"
#include "dapple/modelfile/model.h"
#include "dapple/scenefile/description_builder.h"

namespace dapple::modelfile {

/// Lumens a watt at 555 nm: candela and lux of glTF become W/sr and W/m^2 by it, as Blender's importer has it.
inline constexpr float lumens_a_watt = 683;

/// Adds the lights of a model, and says how many. Those of glTF have physical units. Of other formats, which have none,
/// a light of colour 1 gives a white surface that faces it the radiance 1, at the distance where its own attenuation is
/// 1.
size_t emit_lights(const Model& model, const FileLoc& loc, scenefile::DescriptionBuilder* builder);

}  // namespace dapple::modelfile
