// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "dapple/base/rgb.h"
#include "dapple/base/vec.h"

namespace dapple::shading {

/// How light spreads under a surface: the normalised diffusion profile of Christensen & Burley 2015 ("Approximate reflectance profiles for
/// efficient subsurface scattering"), here for light that enters diffusely ("diffuse surface transmission"):
///   R(r) = A (exp(-r / d) + exp(-r / 3d)) / (8 pi d r),  whose integral over the plane is A.
/// Their fit of the width d is for index-matched media; ours is a table over albedo and index, from our own Monte Carlo of half-spaces below a
/// smooth boundary (docs/design/009): the share of light that leaves within r is right to .02 at indices up to 1.33 and .04 at
/// 1.8; in media that absorb less than .001 of what they scatter, with their long tails, to .06.

/// d in mean free paths of a medium of isotropic scattering. albedo: of single scattering; ior: inside over outside, taken as
/// at least 1 and at most 1.8.
float diffusion_width(float albedo, float ior);

/// An isotropic medium that spreads light far from its entry like one of Henyey & Greenstein's g (similarity; van de Hulst 1980).
struct ReducedMedium {
  float extinction, albedo;
  ReducedMedium(float sigma_t, float full_albedo, float g)
      : extinction(sigma_t * (1 - full_albedo * g)), albedo(full_albedo * (1 - g) / (1 - full_albedo * g)) {}
};
/// The albedo, with g, of which ReducedMedium has this one.
inline float unreduced_albedo(float reduced, float g) { return reduced / (1 - g + reduced * g); }

/// The profile of one channel, up to where 99.5 % of it lies; what is beyond is made up for.
struct DiffusionProfile {
  static constexpr float extent = 15.05f;  ///< widths d that hold that share
  float reflectance = 0, width = 0;

  /// The share of 1 - exp(-x) / 4 - 3/4 exp(-x / 3), x = r / d.
  static float share_within(float x) { return 1 - 0.25f * std::exp(-x) - 0.75f * std::exp(-x / 3); }
  float shape(float r) const { return std::exp(-r / width) + std::exp(-r / (3 * width)); }
  /// Of the distance r from the entry, in [0, r_max], a density over the plane, times r: 1 / (distance times angle).
  float pdf_times_r(float r, float r_max) const { return shape(r) / (8 * pi * width * share_within(r_max / width)); }
  /// R(r) r, likewise made up for what is beyond r_max.
  float value_times_r(float r, float r_max) const { return reflectance * pdf_times_r(r, r_max); }
  /// Distance of the share u of what lies within r_max.
  float sample(float u, float r_max) const;
};

}  // namespace dapple::shading
