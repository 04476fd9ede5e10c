// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/build/material_params.h"
#include "dapple/shading/material.h"

namespace dapple::build {

// What stands in for materials that are not supported; the caller says so.

/// hair: diffuse reflection and transmission of half the hair's colour each. Absorption becomes colour by the fit of
/// Chiang et al. 2016, eq. 9.
shading::MaterialPtr make_hair_stand_in(const MaterialParams& params);
/// measured: diffuse, reflectance 0.5.
shading::MaterialPtr make_measured_stand_in(const MaterialParams& params);

}  // namespace dapple::build
