// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "dapple/base/vec.h"
#include "dapple/forest/canopy_mask.h"
#include "dapple/scene/scene.h"

namespace dapple::vegetation {

/// How a scene's plants become a sheet of leaves.
struct SceneMaskView {
  double centre_x = 0, centre_y = 0;  ///< of the mask, in the scene (m)
  int width = 1, height = 1;
  double pitch = 1;   ///< m
  double plane = 1;   ///< height of the sheet
  double ground = 0;  ///< height of the ground: what lies up to `clearance` above it is left out
  double clearance = 0.05;
  V3d direction{
      0, 0,
      1};  ///< towards the light, unit: what is in the way along it through a point of the sheet is on the sheet there
  int samples = 16;  ///< rays a pixel, the next square
  /// For ground that is not level: its height above `ground` at (x, y); NaN: none, which is clear. Of world
  /// coordinates, m.
  std::function<float(double x, double y)> relief;
};

/// The part of each pixel through which nothing stands in the way in the middle of the shutter: rays on a grid in the
/// pixel, jittered, their random numbers from the pixel's place.
forest::CanopyMask mask_of_scene(const scene::Scene& scene, const SceneMaskView& view, bool periodic);

}  // namespace dapple::vegetation
