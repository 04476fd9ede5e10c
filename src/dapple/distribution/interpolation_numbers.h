// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dapple::distribution {

/// Fitted numbers of irradiance interpolation (docs/design/010).
struct InterpolationNumbers {
  /// Steps of the coarsest lattice: its hemispheres are 2^max_step shading points apart.
  static constexpr int max_step = 5;
  /// Cosine of a turn of the normal that records reach.
  static constexpr float least_cosine = 0.8f;
  /// What hemispheres may differ by, of their mean, at accuracy 1.
  static constexpr float tolerance = 0.25f;
  /// In distances to the nearest thing seen: how far hemispheres on the finest lattice reach, two points apart. Beside
  /// an edge they would never be near enough, and each point there would send all rays of its own.
  static constexpr float finest_reach = 4;
  /// Accuracies by which a lattice misses that makes the next but one be tried.
  static constexpr float two_steps_beyond = 4;
  /// Of a hemisphere's cell: how wide its rays start, for the choice of the radiosity cache's resolution. Where
  /// hemispheres are sparse there is nothing near that would need finer cells.
  static constexpr float ray_width = 0.25f;
  /// At accuracy 1, the share of glints in what arrives that may be interpolated: hemispheres whose rays find spots by
  /// chance agree where all missed them.
  static constexpr float most_glints = 0.05f;
  /// The step from which hemispheres send more rays, in proportion to the root of how many points they stand for: what
  /// noise wide ones have shows as blotches. And how many at most, if none was asked for.
  static constexpr int first_wide = 3, most_rays = 1024;
  /// A point that is not interpolated sends 1 / unserved_share of a hemisphere's rays; all of them if glints are the
  /// reason.
  static constexpr int unserved_share = 4;
};

}  // namespace dapple::distribution
