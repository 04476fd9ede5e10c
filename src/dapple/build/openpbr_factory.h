// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "dapple/build/material_params.h"
#include "dapple/shading/material.h"

namespace dapple::build {

/// Material "openpbr": the parameters of OpenPBR 1.1 by their names (docs/guide/materials.md). What is not supported is
/// named once. Its emission is an area light: emission_of().
shading::MaterialPtr make_openpbr(const MaterialParams& params);

/// The AreaLightSource that "emission_luminance" (cd/m^2; 683 are radiance 1) and "emission_color" of an openpbr
/// material ask for; nothing where it does not shine. InputError where the luminance is no constant.
std::optional<scenefile::Entity> emission_of(const scenefile::MaterialEntity& material);

}  // namespace dapple::build
