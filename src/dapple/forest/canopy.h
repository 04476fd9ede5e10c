// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "dapple/forest/constituent.h"

namespace dapple::forest {

/// The surface below: Lambertian reflectance by wavelength, or any bidirectional function that is even in azimuth.
struct Ground {
  std::vector<double> reflectance;  ///< [wavelength], 0 to 1; used without `brdf`
  /// 1/sr, for light that arrives at cosine mu_in and leaves at mu_out (both positive against the zenith); dphi between
  /// the directions of propagation, so that dphi = pi is back towards the source. Reciprocal, albedo at most one.
  std::function<double(double mu_in, double mu_out, double dphi, int wavelength)> brdf;
};

/// Rahman, Pinty and Verstraete 1993: rho0 [wavelength], k the bowl or bell shape (1 is Lambertian in zenith),
/// asymmetry Theta in (-1, 1) of the Henyey-Greenstein factor (negative is backward), hot spot 1 + (1 - rho0) / (1 +
/// G).
Ground rpv_ground(std::vector<double> rho0, double k, double asymmetry);

/// Plane-parallel vegetation: slabs from the ground up, each with any mix of constituents.
struct Canopy {
  struct Slab {
    double bottom_m = 0, top_m = 0;
    std::vector<double> amount;  ///< by constituent: leaf area index (times clumping), or optical depth, of this slab
  };
  int wavelengths = 1;
  std::vector<std::shared_ptr<const Constituent>> constituents;
  std::vector<Slab> slabs;
  Ground ground;
};

}  // namespace dapple::forest
