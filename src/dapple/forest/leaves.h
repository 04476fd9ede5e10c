// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/forest/constituent.h"

namespace dapple::forest {

/// Two-sided leaves (or bark, with transmittance zero): bi-Lambertian scattering by wavelength, and, with a refractive
/// index, mirror reflection at their surface by Fresnel's formula on top of it (5.3). The unit is leaf area index one.
class Leaves final : public Constituent {
 public:
  /// reflectance and transmittance by wavelength, of equal length, each at least 0, their sum at most 1.
  /// refractive_index: 0 for none, else at least 1; needs a density of inclinations. std::invalid_argument otherwise.
  Leaves(LeafAngles angles, std::vector<double> reflectance, std::vector<double> transmittance,
         double refractive_index = 0);

  const LeafAngles& angles() const { return angles_; }
  bool specular() const { return refractive_index_ > 0; }
  /// Fraction of the intercepted light from a direction that the mirror component returns.
  double specular_albedo(double mu) const;

  int components() const override { return specular() ? 3 : 2; }  ///< reflectance, transmittance, mirror
  double coefficient(int component, int wavelength) const override;
  double extinction(double mu) const override { return angles_.projection(mu); }
  Kernel kernel(Directions& directions) const override;
  KernelColumn column(Directions& directions) const override;
  void phases(double mu_in, double mu_out, double dphi, double* out) const override;

 private:
  double mirror(double mu_in, double mu_out, double cos_dphi) const;
  double mirror_scattering(double mu) const;
  void mirror_modes(double mu_i, double mu_j, int modes, double* out, size_t stride) const;

  LeafAngles angles_;
  std::vector<double> reflectance_, transmittance_;
  double refractive_index_;
};

}  // namespace dapple::forest
