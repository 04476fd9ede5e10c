// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/build/material_params.h"
#include "dapple/shading/material.h"

namespace dapple::build {

/// Material "hair" with pbrt-v4's parameters (docs/guide/materials.md).
shading::MaterialPtr make_hair(const MaterialParams& params);

}  // namespace dapple::build
