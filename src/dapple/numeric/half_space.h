// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace dapple {
inline namespace numeric {

/// Share of the light that has entered a half-space which leaves it again: isotropic scattering of single-scattering
/// albedo `albedo` in [0, 1] below a smooth dielectric boundary of index `eta` (inside over outside). The light entered
/// diffusely: from a hemisphere of constant radiance, less what the boundary reflected. By Chandrasekhar's H-function
/// (Radiative Transfer, 1950, ch. V), and the boundary's internal reflection by a linear system on 48 Gauss nodes.
/// Within 1e-3 of Monte Carlo; one for albedo 1.
double half_space_reflectance(double albedo, double eta);

/// The same for one index as a table, and its inverse. Albedos in between by linear interpolation over sqrt(1 -
/// albedo), in which reflectance is smooth: within 5e-4.
class HalfSpaceTable {
 public:
  explicit HalfSpaceTable(double eta);
  float reflectance(float albedo) const;
  float albedo(float reflectance) const;  ///< for reflectance in [0, 1]; one for one

 private:
  std::vector<float> reflectance_;  ///< of albedo 1 - (i / n)^2: falls
};

}  // namespace numeric
}  // namespace dapple
