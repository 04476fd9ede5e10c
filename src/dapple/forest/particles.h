// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/forest/constituent.h"

namespace dapple::forest {

/// Scatterers without orientation, such as haze: single-scattering albedo by wavelength and a phase function by its
/// Legendre moments, p(cos) = sum (2 l + 1) chi_l P_l(cos) with mean one over the sphere. The unit is optical depth
/// one.
class Particles final : public Constituent {
 public:
  /// chi[0] = 1, |chi[l]| <= 1, at most 128 of them; albedo in [0, 1]. std::invalid_argument otherwise.
  Particles(std::vector<double> chi, std::vector<double> albedo);
  static Particles isotropic(std::vector<double> albedo) { return {{1.0}, std::move(albedo)}; }
  static Particles rayleigh(std::vector<double> albedo) { return {{1.0, 0.0, 0.1}, std::move(albedo)}; }

  int components() const override { return 1; }
  double coefficient(int, int wavelength) const override { return albedo_[wavelength]; }
  double extinction(double) const override { return 1; }
  Kernel kernel(Directions& directions) const override;
  KernelColumn column(Directions& directions) const override;
  void phases(double mu_in, double mu_out, double dphi, double* out) const override;

 private:
  std::vector<double> legendre(double mu, int modes) const;
  std::vector<double> node_legendre(const PolarNodes& nodes, int i, int modes) const;
  void add(const std::vector<double>& a, const std::vector<double>& b, int modes, double* same, double* opposite,
           size_t stride) const;

  std::vector<double> chi_, albedo_;
};

}  // namespace dapple::forest
