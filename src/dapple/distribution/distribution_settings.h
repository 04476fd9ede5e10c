// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "dapple/distribution/grid_numbers.h"
#include "dapple/distribution/pixel_points.h"
#include "dapple/distribution/shading_scene.h"
#include "dapple/forest/ground_visibility.h"
#include "dapple/forest/mask_visibility.h"

namespace dapple::distribution {

/// Where surfaces that the camera sees are shaded.
enum class VisiblePoints {
  grids,   ///< at points of shading grids, each for all camera samples around it (Cook et al. 1987)
  samples  ///< where camera samples met them, each sending its part of a point's rays; on grids where shading is dear
};

/// How DistributionIntegrator renders.
struct DistributionSettings {
  ShadingSettings shading;
  VisiblePoints visible_points = VisiblePoints::grids;
  float shading_rate = 1;  ///< area of a micropolygon in pixels
  int pixel_samples = 16;  ///< that a pixel gets
  /// The same where it is noisy, if that is more: so many share what mirrors, gloss and media show there.
  int max_pixel_samples = 0;
  /// Number of small patches (leaves, say) that each pixel shades, of those that its samples see, beside one of each
  /// further material and side; 0: all.
  int pixel_points = 3;
  size_t grid_bytes = size_t(512) << 20;   ///< of shading grids kept; beyond, they are shaded again
  bool radiosity_cache = true;             ///< diffuse rays end in it; else what they hit is shaded
  bool subsurface_cache = true;            ///< the light that enters subsurface bodies is cached too
  size_t cache_bytes = size_t(100) << 20;  ///< of the radiosity, irradiance and hemisphere caches
  /// Interpolates indirect light of visible points; the first number of diffuse rays is that of a hemisphere then.
  bool irradiance_interpolation = false;
  float irradiance_accuracy = 0.4f;  ///< IrradianceInterpolator::Settings::accuracy
  bool light_groups = false;         ///< what groups of lights give is kept apart, for films that ask for it
  bool log_caches = false;           ///< for view_caches(): at most 70 MB a thread
  std::shared_ptr<const forest::MaskVisibility> masks;  ///< in place of shadow rays to sun and sky; null: none
  /// Asked before `masks`, for which it answers too; null: none.
  std::shared_ptr<const forest::GroundVisibility> far_ground;
  /// Of this scene, whatever its lights, and of these settings; null: they are surveyed.
  std::shared_ptr<const SurveyedReaders> readers;
  StopToken stop;  ///< of what is found out before rendering, which throws Stopped then

  /// A pixel may see more small patches than it shades.
  bool chooses_points() const {
    return pixel_points > 0 && pixel_points <= std::min(pixel_samples, int(GridNumbers::first_samples));
  }
  int sharing_samples() const { return std::max(pixel_samples, max_pixel_samples); }
};

}  // namespace dapple::distribution
