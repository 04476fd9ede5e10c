// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

namespace dapple::forest {

/// Radiance of the sky for light that arrives from zenith angle acos(mu) and azimuth phi, the direction to the sky
/// measured from the direction to the sun: W m^-2 sr^-1, or relative if an irradiance is given.
struct Sky {
  std::function<double(double mu, double phi, int wavelength)> radiance;
  bool grey = true;           ///< the same for all wavelengths: asked for wavelength 0 only
  bool no_azimuth = false;    ///< does not depend on phi
  static Sky uniform();       ///< 1 / pi: irradiance one
  static Sky cie_overcast();  ///< CIE standard overcast sky, (1 + 2 mu) / 3 of the zenith; irradiance one
  /// CIE standard clear sky (CIE S 011 type 12), gradation a = -1, b = -.32, indicatrix c = 10, d = -3, e = .45;
  /// relative.
  static Sky cie_clear(double sun_mu);
};

/// Of Sky::cie_clear(), from the cosine of the angle to the sun.
double cie_clear_radiance(double mu, double cos_gamma);

}  // namespace dapple::forest
