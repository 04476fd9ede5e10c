// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/build/material_params.h"
#include "dapple/shading/material.h"

namespace dapple::build {

/// subsurface, by pbrt-v4's parameters: of `name`, `reflectance` (with `mfp`), and `sigma_a` with `sigma_s`, one
/// describes what is inside; without any it is whole milk. Coefficients in 1/mm and `mfp` in mm for scenes in
/// millimetres; `scale` times either. Unknown names, more than one description, coefficients that are negative, and a g
/// outside (-1, 1) throw InputError.
shading::MaterialPtr make_subsurface(const MaterialParams& params);

}  // namespace dapple::build
