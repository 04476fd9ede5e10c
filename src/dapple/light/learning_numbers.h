// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dapple::light {

/// Fitted numbers of learning which light reaches regions (docs/design/029). Only densities depend on them: with any of
/// them, images have the same mean. Those of regions and of cells of skies: emitters::RegionNumbers.
struct LearningNumbers {
  /// Rays of a point to each sky: one a stratum, of so many along a side; then so many where those found light.
  static constexpr int strata = 4, more_sky_rays = 8;
  /// Rays of a point to lamps.
  static constexpr int lamp_rays = 4;
  /// Of points, those in regions that must gain, or all is left as it was: samples by what was learned cost more.
  static constexpr double least_gaining = 0.25;
  /// What the region around counts beside a region's own: so many rays, or points.
  static constexpr float trials_around = 2, points_around = 4;
  /// A sky is drawn by its cells where the expected square falls to this part at least.
  static constexpr float pays_below = 0.7f;
  /// Of a sky's samples, those that are drawn by luminance, and evenly, whatever was seen.
  static constexpr float by_luminance = 0.4f, by_area = 0.05f;
  /// What is left to choices that learning found to bring nothing: to lamps, or to lights at infinity, of all samples;
  /// to a light at infinity, of an even share; to a sky, of its light; to a lamp, of its light unshadowed.
  static constexpr float least_class = 0.1f, least_light = 0.15f, least_sky = 0.1f, least_visibility = 0.1f;
  /// Factor by which the choice between two parts of the light tree is changed at most.
  static constexpr float most_odds = 32;
};

}  // namespace dapple::light
