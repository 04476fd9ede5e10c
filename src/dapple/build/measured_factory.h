// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/build/material_params.h"
#include "dapple/shading/material.h"

namespace dapple::build {

/// Material "measured": "filename" of a tensor file (.bsdf) or a MERL table (.binary). Throws InputError where it
/// cannot be read.
shading::MaterialPtr make_measured(const MaterialParams& params);

}  // namespace dapple::build
