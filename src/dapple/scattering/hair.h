// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "dapple/scattering/bsdf.h"

namespace dapple::scattering {

/// Scattering by a fibre: Chiang, Bitterli, Tappan and Burley 2016 (A practical and controllable hair and fur model for
/// production path tracing), with pbrt-v4's parameters. Local frame: x along the fibre, z towards the outside of the
/// curve, y across it. Lobes p: light that is reflected (0), that passes (1), that is reflected once inside (2), and
/// all else (3).
class HairFibre {
 public:
  static constexpr int lobes = 4;

  HairFibre() = default;
  explicit HairFibre(const Bsdf& bsdf);  ///< of kind hair
  Bsdf bsdf() const;

  float h = 0;                         ///< where across the fibre, in [-1, 1], growing along y
  float eta = 1.55f;                   ///< index of the fibre over that outside
  RGB sigma_a;                         ///< absorption, per radius
  float beta_m = 0.3f, beta_n = 0.3f;  ///< roughness along and across, in (0, 1]
  float tilt = 2;                      ///< of the scales, degrees

  RGB eval(const V3f& wo, const V3f& wi, float* pdf) const;
  bool sample(const V3f& wo, float u1, const V2f& u2, uint64_t key, BsdfSample* out) const;
  /// What is scattered, mean over directions.
  RGB albedo() const;
  /// What the lobes keep of light from a direction with this cosine to the plane across the fibre.
  std::array<RGB, lobes> attenuation(float cos_theta_o) const;

 private:
  struct Setup;
};

/// Absorption that gives this colour to light hair (eq. 9 of the paper).
RGB hair_absorption(RGB color, float beta_n);
/// Of pigments, concentrations.
RGB hair_absorption(float eumelanin, float pheomelanin);

}  // namespace dapple::scattering
