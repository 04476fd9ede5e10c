// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/scattering/bsdf.h"

namespace dapple::scattering {

/// Sheets: surfaces that let light straight through, so that rays towards lights pass as they do where nothing is,
/// weakened: thin panes, boundaries between equal indices, and what is not there.

/// Share that a slab of index ior with reflectance F (Fresnel) at each side reflects, all interreflections summed: 2 F
/// / (1 + F).
float slab_reflectance(float cosine, float ior);

/// Of the light that arrives against wo, the share that goes straight on: 1 - slab_reflectance() for thin panes, 1 for
/// boundaries between equal indices and passthrough; else 0.
float straight_transmittance(const Bsdf& bsdf, const V3f& wo);

}  // namespace dapple::scattering
