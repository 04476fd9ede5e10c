// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/vec.h"

namespace dapple::shading {

/// Gradient noise (Perlin 2002): smooth, zero at integer points, about [-1, 1], repeating every 256. The permutation is
/// Perlin's and the choice of gradients pbrt's, so that patterns agree with pbrt's.
float gradient_noise(const V3f& p);

/// Fractional Brownian motion: `octaves` noises, each at 1.99 times the frequency and `omega` times the amplitude of
/// the last. Octaves finer than the footprint are left out, the last one faded.
float fbm(const V3f& p, const V3f& dpdx, const V3f& dpdy, float omega, int octaves);

/// The same sum of absolute values; octaves left out are replaced by their mean, about .2, so that the whole keeps its
/// mean at any distance (pbrt-v4 counts the fading octave twice).
float turbulence(const V3f& p, const V3f& dpdx, const V3f& dpdy, float omega, int octaves);

}  // namespace dapple::shading
