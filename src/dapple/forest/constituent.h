// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/forest/directions.h"

namespace dapple::forest {

/// What a constituent does to light between the nodes, for a unit of it (leaf area index one, or optical depth one).
/// sigma^m(mu, mu') is the integral over the turn of sigma cos m dphi (5.3); both mu are positive. Each component is
/// multiplied by an optical property of the wavelength.
struct Kernel {
  struct Component {
    std::vector<double> same;      ///< [m][i][j] sigma^m(mu_i, mu_j): both upwards, or both downwards
    std::vector<double> opposite;  ///< [m][i][j] sigma^m(mu_i, -mu_j): from one hemisphere to the other
  };
  std::vector<double> extinction;  ///< [i]
  std::vector<Component> components;
};

/// The same between the nodes and one more direction mu_0: same[m][i] = sigma^m(mu_i, mu_0) = sigma^m(mu_0, mu_i).
struct KernelColumn {
  double extinction = 0;
  std::vector<Kernel::Component> components;
};

/// A population of scatterers that looks the same from above and below and from all azimuths, with reciprocal
/// scattering that keeps the polarity: sigma(w' -> w) = sigma(-w -> -w') = sigma(w -> w').
class Constituent {
 public:
  virtual ~Constituent() = default;

  virtual int components() const = 0;
  /// Optical property that multiplies a component: leaf reflectance, leaf transmittance, albedo.
  virtual double coefficient(int component, int wavelength) const = 0;
  /// kappa for a unit of the constituent: mean projection of leaves, 1 of particles.
  virtual double extinction(double mu) const = 0;
  /// Kernels between the nodes. The flux scattered out of each node is exact: what the quadrature misses is put on the
  /// diagonal as forward scatter (5.4, energy fix).
  virtual Kernel kernel(Directions& directions) const = 0;
  /// Kernels of directions.extra(), scaled so that the flux scattered out of it is exact.
  virtual KernelColumn column(Directions& directions) const = 0;
  /// sigma of all components for propagation directions of signed cosines, dphi apart in azimuth: 1/sr for a unit.
  virtual void phases(double mu_in, double mu_out, double dphi, double* out) const = 0;
  double phase(int component, double mu_in, double mu_out, double dphi) const;
};

/// Adds to the diagonals what the nodes' scattered flux lacks of `total` [i] (5.4).
void fix_energy(const PolarNodes& nodes, int modes, const std::vector<double>& total, Kernel::Component& component);
/// Scales a column to the scattered flux `total`.
void fix_energy(const PolarNodes& nodes, double total, Kernel::Component& column);

}  // namespace dapple::forest
