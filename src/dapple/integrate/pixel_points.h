// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/integrate/camera_batch.h"
#include "dapple/integrate/grid_store.h"

namespace dapple::integrate {

/// The small patches, leaves say, that the pixels of a block have seen and shaded. One of these, of the same material and side, stands for any other
/// that further samples see (docs/design/016).
class PixelPoints {
 public:
  /// Of a pixel, whose small patches may be lent to all others.
  static constexpr uint32_t remembered_samples = 16;
  /// Patches, or groups of them, of so few points that a pixel's samples may see many.
  static bool is_small(const scene::GridId& grid) { return grid.u_level + grid.v_level <= 2; }

  void clear() {
    for (auto& seen : seen_) seen.clear();
  }
  void remember(int pixel, const scene::GridPoint& point, const GridStore::GridPtr& grid) { seen_[pixel].push_back({point, grid}); }
  /// Replaces what a sample saw, of a small patch, by one of those that its pixel remembers. False, and nothing done, while these are fewer than
  /// `enough`, or where none of them is of its kind. `key`: of the choice.
  bool lend(const scene::Scene& scene, int pixel, int enough, uint64_t key, scene::GridPoint* point, GridStore::GridPtr* grid) const;

 private:
  struct Seen {
    scene::GridPoint point;
    GridStore::GridPtr grid;
  };
  std::vector<Seen> seen_[CameraBatch::capacity];
};

}  // namespace dapple::integrate
