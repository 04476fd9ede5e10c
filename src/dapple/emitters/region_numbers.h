// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dapple::emitters {

/// Fitted numbers of regions of learned light, and of cells of skies (docs/design/029). Only densities depend on them.
struct RegionNumbers {
  /// Points of a cube that is not split.
  static constexpr int most_points = 64;
  /// Points of a region, which is one kind of receiver in a cube: fewer belong to that of the cube around.
  static constexpr int least_points = 12;
  /// Of a cube's side, how far from itself a point looks for its region, to either side: no region's end is seen.
  static constexpr float reach = 0.25f;
  /// Of a sky's cell's mean luminance, what a piece counts at least: pieces are looked at by a filter.
  static constexpr float least_share = 0.05f;
  /// Of that mean, how bright the brightest piece is where finer ones are looked at: a sun is smaller than a piece.
  static constexpr float fine_above = 8;
  /// Of that mean, how bright the brightest piece of a cell may be that is drawn from evenly, for less.
  static constexpr float even_below = 2;
};

}  // namespace dapple::emitters
