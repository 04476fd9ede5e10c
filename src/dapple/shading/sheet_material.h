// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/shading/material.h"

namespace dapple::shading {

/// Whether scattering::straight_transmittance() of some Bsdf of the material's prelighting may be above 0. False for
/// shaders of plug-ins.
bool may_be_sheet(const Material& material);

}  // namespace dapple::shading
