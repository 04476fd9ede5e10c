// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

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
  /// Facets whose areas are counted one by one: of objects that are placed so often that there are more, instances
  /// drawn at random stand for all. Half of it doubles the variance of what many trees of different sizes add up to.
  static constexpr size_t most_facets = size_t(1) << 25;
  /// Instances that stand in objects, or are placed by files, and are looked at: where there are more, of each object
  /// one of a stretch of equal length stands for that. Only memory and time ask for fewer.
  static constexpr size_t most_placed = size_t(1) << 22;
};

}  // namespace dapple::vegetation
