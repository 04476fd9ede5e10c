// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dapple/forest/leaf_angles.h"
#include "dapple/forest/solver.h"

namespace dapple::canopyfile {

/// What a file for `dapple canopy solve` says (docs/guide/canopy.md), checked. Numbers by wavelength are of equal
/// length.
struct CanopyInput {
  struct Layer {
    double bottom_m = 0, top_m = 0, leaf_area_index = 0, clumping_index = 1, refractive_index = 0;
    forest::LeafAngles angles = forest::LeafAngles::spherical();
    std::vector<double> reflectance, transmittance;
  };
  struct Sun {
    double zenith_deg = 0, azimuth_deg = 0;
    std::vector<double> irradiance_W_m2;  ///< on a plane normal to the beam
  };
  struct SkyLight {
    std::string type = "uniform", image;
    std::vector<double> irradiance_W_m2;  ///< on a horizontal plane
  };
  struct View {
    double zenith_deg = 0, azimuth_deg = 0;
  };

  std::string path;  ///< of the file, for messages
  int wavelengths = 1;
  std::vector<double> wavelengths_nm;  ///< empty if not given
  std::vector<Layer> layers;
  std::vector<double> ground;
  std::string ground_type = "lambertian";
  double rpv_k = 1, rpv_asymmetry = 0;
  std::optional<Sun> sun;
  std::optional<SkyLight> sky;
  std::vector<View> views;
  int nodes = 8, modes = 6, slabs = 10;
  bool mobley = false;
  forest::Method method = forest::Method::adding_doubling;
  double hot_spot_leaf_size_m = 0;

  /// The canopy for wavelengths [first, first + count): layers spread over slabs that end wherever a layer does.
  forest::Canopy canopy(int first, int count) const;
  forest::SolverOptions options() const;
  std::string wavelength_name(int w) const;  ///< "550 nm", or the channel
};

/// InputError with the field, its value and what is legal; also for what is not JSON, too deep, too large, or has
/// unknown keys.
CanopyInput read_canopy_input(const std::string& path);

}  // namespace dapple::canopyfile
