// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dapple::vegetation {

/// Fitted numbers of surveys of canopies (docs/design/008, 011).
struct CanopyNumbers {
  /// Directions in which gaps are measured, evenly in the cosine of the zenith angle from 1 down to the other: lower
  /// ones see no gap.
  static constexpr int gap_directions = 8;
  static constexpr double lowest_gap_cosine = 0.2;
  /// Clumping index of a slab, at least: rays that passed by chance say no less.
  static constexpr double least_clumping = 0.02;
  /// Of the plot's sides: a flat thing that reaches over so much is its ground.
  static constexpr float ground_share = 0.9f;
};

}  // namespace dapple::vegetation
