// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace dapple::forest {

/// Radiance over the upper half of the sky in cells of equal angles: zenith on top, the first column begins at azimuth
/// 0. Bilinear between the middles of cells; constant beyond those of the first and last row.
struct SkyTable {
  int rows = 2, columns = 1;   ///< at least 2 rows
  int channels = 1;            ///< one is that of all wavelengths
  std::vector<double> values;  ///< [row][column][channel]

  /// mu: cosine of the zenith angle, from 0; phi: azimuth, radians; w: wavelength.
  double at(double mu, double phi, int w) const;
};

}  // namespace dapple::forest
