// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "dapple/forest/penumbra.h"

namespace dapple::app {

/// What the command line of `dapple penumbra` says.
struct PenumbraOptions {
  std::vector<std::string> masks, outputs;
  std::vector<double> heights;
  double mask_width = 0;
  std::string mask_scene, mask_pixels = "512x512", mask_centre = "0,0", mask_along = "zenith", write_mask;
  double mask_ground = 0;
  int mask_samples = 16;
  bool periodic = false;
  std::string planes = "independent";

  double sun_zenith = 0, sun_azimuth = 0, sun_irradiance = 0, sun_diameter = 0.533;
  std::string sun_image;
  bool flat_sun = false;
  std::string sky = "uniform";
  std::optional<double> sky_irradiance;
  double turbidity = 3, sky_cell = 1.0 / 64;

  std::string location, date, time_range;
  int frames = 24;

  std::optional<double> png_white;
  std::string stats;
  int threads = 0;
  bool quiet = false;
};

void add_penumbra_options(CLI::App& app, PenumbraOptions& o);

/// The sun of one picture, angles in degrees, azimuth from +x to +y.
struct SunPlace {
  double zenith_deg = 0, azimuth_deg = 0;
  std::string when;  ///< "2024-06-21 09:30" of an animation
};

/// One place, or those of an animation. InputError where an option is out of range or the sun is below the horizon,
/// naming option and range; UsageError where options do not go together.
std::vector<SunPlace> sun_places(const PenumbraOptions& o);

/// InputError for numbers out of range. Files are not read.
void check_penumbra_options(const PenumbraOptions& o);

/// "512x256", both at least 1.
V2i mask_pixels(const PenumbraOptions& o);
/// "X,Y" in metres.
std::pair<double, double> mask_centre(const PenumbraOptions& o);

/// nullopt where there is none.
std::optional<forest::SunDisc> make_sun(const PenumbraOptions& o, const SunPlace& place);
/// The sky's file is read by read_sky_file, once.
std::optional<forest::SkyDome> read_sky_file(const PenumbraOptions& o);
std::optional<forest::SkyDome> make_sky(const PenumbraOptions& o, const SunPlace& place,
                                        const std::optional<forest::SkyDome>& file);

}  // namespace dapple::app
