// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "dapple/canopyfile/canopy_input.h"

namespace dapple::canopyfile {

/// What `dapple canopy solve` reports; arrays by wavelength are innermost. NaN where no light comes in.
struct CanopySolution {
  std::vector<double> black_sky, white_sky, actual;      ///< albedo; black_sky empty without sun
  std::vector<double> transmitted, transmitted_direct;   ///< of the incident irradiance, to the ground
  std::vector<double> absorbed_canopy, absorbed_ground;  ///< of the incident irradiance
  std::vector<double> heights_m;                         ///< levels, from the ground up
  std::vector<double> down_direct, down_diffuse, up;     ///< [level][wavelength] W m^-2
  std::vector<double> reflectance_factor;                ///< [view][wavelength]
  int principal_angles = 0;                              ///< odd; from -85 (the sun's side) to 85 degrees
  std::vector<double> principal_plane;                   ///< [angle][wavelength], for plots
  int polar_zeniths = 0, polar_azimuths = 0;
  std::vector<double> polar;  ///< [zenith][azimuth][wavelength] reflectance factor, for plots
  int field_rows = 0, field_columns = 0;
  std::vector<float> field;  ///< [level][row][column][wavelength] W m^-2 sr^-1, for EXR
};

struct CanopyWanted {
  bool plots = false, field = false;
};

/// InputError for what the solver refuses.
CanopySolution solve_canopy(const CanopyInput& input, const CanopyWanted& wanted);

std::string canopy_json(const CanopyInput& input, const CanopySolution& s);
std::string canopy_csv(const CanopyInput& input, const CanopySolution& s);
/// Radiance seen in all directions at each height, without the sun's disc.
void write_canopy_exr(const std::string& path, const CanopyInput& input, const CanopySolution& s);

}  // namespace dapple::canopyfile
