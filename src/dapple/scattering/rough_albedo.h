// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/rgb.h"

namespace dapple::scattering {

// What rough boundaries do to diffuse light, by fits of ours to our own integration.

/// Cosine-weighted mean of a conductor's reflectance; 4-point Gauss rule in cos^2.
RGB mean_fresnel(RGB eta, RGB k);
/// One roughness for two, by their squares.
float mean_alpha(float x, float y);
/// Share of diffuse light that a lossless GGX mirror returns, the rest being what single scattering misses; within
/// 0.005.
float ggx_mean_albedo(float alpha_x, float alpha_y);

// What becomes of diffuse light at a rough dielectric of mean_alpha a, at most 1: what is scattered more than once
// between its facets is lost. Within 0.006 for indices from 1.33 to 1.8.

/// The share that it mirrors of light from above, where a smooth one mirrors `smooth`.
float rough_coat_reflectance(float a, float smooth);
/// The share of what crosses a smooth one that crosses it, either way.
float rough_coat_crossing(float a);
/// The share that it sends back of light from below, where a smooth one sends back `smooth`.
float rough_coat_return(float a, float smooth);

}  // namespace dapple::scattering
