// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dapple::vegetation {

/// Fitted numbers of the light on far ground (docs/design/020).
struct GroundNumbers {
  /// Pixels a side of a plot that needs no more for its detail.
  static constexpr int usual_pixels = 3072;
  /// Pixels of a cell of the sky's sheet a side, the coarsest.
  static constexpr int coarsest = 16;
  /// Cells a side of the picture that finds where anything stands.
  static constexpr int scout_cells = 512;
  /// Of a sun's direction, its rise, at least; radians of its radius, at most.
  static constexpr double least_rise = 0.1;
  static constexpr float widest_sun = 0.1f;
  /// The sky: rows of its directions, and pixels of a cell of its sheet, of the sheet's height.
  static constexpr int sky_rows = 64;
  static constexpr double sky_cell = 1.0 / 32;
};

}  // namespace dapple::vegetation
