// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace dapple::vegetation {

/// Fitted numbers of pruned aggregates (docs/design/033; half and double of them: measurements/033-pruned-leaves.md).
struct PruningNumbers {
  /// The level of detail "auto": to how many pixels what is kept may grow.
  static constexpr float pixels = 0.5f;
  /// Meshes of fewer components are no aggregate.
  static constexpr uint32_t least_components = 64;
  /// Of the diagonal of the mesh's box: components that are larger are no detail.
  static constexpr float largest_component = 1.0f / 8;
  /// Of the size that what is kept may have: the diagonal of what it stands for, at most.
  static constexpr float most_spread = 16;
  /// Of the box that spreads as a cluster does, turned in any way: where components fill more, as bricks, cobbles and
  /// pebbles that lie in heaps, they are a solid.
  static constexpr float most_filled = 0.2f;
  /// Volume over the power 3/2 of the area (of a cube .07): less is a surface that is not quite flat.
  static constexpr float least_closed = 1e-3f;
  /// Components so many times as long as wide grow across alone.
  static constexpr float elongated = 4;
};

}  // namespace dapple::vegetation
