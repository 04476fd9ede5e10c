// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/shading/bsdf.h"
#include "dapple/shading/material.h"

namespace dapple::shading {

/// Sheets: surfaces that let light straight through, so that rays towards lights pass as they do where nothing is,
/// weakened: thin panes, boundaries between equal indices, and what is not there.

/// Share that a slab of index ior with reflectance F (Fresnel) at each side reflects, all interreflections summed: 2 F
/// / (1 + F).
float slab_reflectance(float cosine, float ior);

/// Of the light that arrives against wo, the share that goes straight on: 1 - slab_reflectance() for thin panes, 1 for
/// boundaries between equal indices and passthrough; else 0.
float straight_transmittance(const Bsdf& bsdf, const V3f& wo);

/// Whether straight_transmittance() of some Bsdf of the material's prelighting may be above 0. False for shaders of
/// plug-ins.
bool may_be_sheet(const Material& material);

}  // namespace dapple::shading
