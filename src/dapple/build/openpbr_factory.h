// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "dapple/build/material_params.h"
#include "dapple/media/medium.h"
#include "dapple/shading/material.h"

namespace dapple::build {

/// Material "openpbr": the parameters of OpenPBR 1.1 by their names (docs/guide/materials.md). What is not supported is
/// named once. Its emission is an area light: emission_of().
shading::MaterialPtr make_openpbr(const MaterialParams& params);

/// The AreaLightSource that "emission_luminance" (cd/m^2; 683 are radiance 1) and "emission_color" of an openpbr
/// material ask for; nothing where it does not shine. InputError where the luminance is no constant.
std::optional<scenefile::Entity> emission_of(const scenefile::MaterialEntity& material);

/// True where the material fills what it bounds with a medium: interior_of().
bool has_interior(const scenefile::MaterialEntity& material);
/// What "transmission_depth" (metres in which light becomes "transmission_color"), "transmission_scatter" and
/// "transmission_scatter_anisotropy" say of the inside of a body; null where they say nothing.
std::shared_ptr<const media::Medium> interior_of(const scenefile::MaterialEntity& material,
                                                 const BuildContext& context);

}  // namespace dapple::build
