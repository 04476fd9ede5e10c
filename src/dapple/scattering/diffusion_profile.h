// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "dapple/base/rgb.h"
#include "dapple/base/vec.h"

namespace dapple::scattering {

/// How light spreads under a surface: the normalised diffusion profile of Christensen & Burley 2015 ("Approximate
/// reflectance profiles for efficient subsurface scattering"), here for light that enters diffusely ("diffuse surface
/// transmission"):
///   R(r) = A (exp(-r / d) + exp(-r / 3d)) / (8 pi d r),  whose integral over the plane is A.
/// Their fit of the width d is for index-matched media; ours is a table over albedo and index, from our own Monte Carlo
/// of half-spaces below a smooth boundary (docs/design/012): the share of light that leaves within r is right to .02 at
/// indices up to 1.33 and .04 at 1.8; in media that absorb less than .001 of what they scatter, with their long tails,
/// to .06.

/// d in mean free paths of a medium of isotropic scattering. albedo: of single scattering; ior: inside over outside,
/// taken as at least 1 and at most 1.8.
float diffusion_width(float albedo, float ior);

/// An isotropic medium that spreads light far from its entry like one of Henyey & Greenstein's g (similarity; van de
/// Hulst 1980).
struct ReducedMedium {
  float extinction, albedo;
  ReducedMedium(float sigma_t, float full_albedo, float g)
      : extinction(sigma_t * (1 - full_albedo * g)), albedo(full_albedo * (1 - g) / (1 - full_albedo * g)) {}
};

/// The profile of one channel, cut off at a distance r_max; what is beyond is made up for.
class DiffusionProfile {
 public:
  static constexpr float extent = 15.05f;  ///< widths d that hold 99.5 % of it

  DiffusionProfile() = default;
  DiffusionProfile(float reflectance, float width, float r_max)
      : reflectance_(reflectance),
        width_(width),
        r_max_(r_max),
        share_(share_within(r_max / width)),
        scale_(1 / (8 * pi * width * share_)) {}

  /// The share of 1 - exp(-x) / 4 - 3/4 exp(-x / 3), x = r / d.
  static float share_within(float x) { return 1 - 0.25f * std::exp(-x) - 0.75f * std::exp(-x / 3); }
  /// Of the distance r from the entry, in [0, r_max], a density over the plane, times r: 1 / (distance times angle).
  float pdf_times_r(float r) const {
    const float y = std::exp(r * (-1 / 3.0f) / width_);
    return (y * y * y + y) * scale_;
  }
  /// R(r) r.
  float value_times_r(float r) const { return reflectance_ * pdf_times_r(r); }
  /// Distance of the share u of what lies within r_max.
  float sample(float u) const;

 private:
  float reflectance_ = 0, width_ = 1, r_max_ = 0, share_ = 1, scale_ = 0;
};

}  // namespace dapple::scattering
