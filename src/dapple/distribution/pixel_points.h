// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <vector>

#include "dapple/distribution/grid_numbers.h"
#include "dapple/integrate/camera_batch.h"
#include "dapple/scene/patch_table.h"
#include "dapple/scene/scene.h"

namespace dapple::distribution {

/// The small patches, leaves say, that the pixels of a block shade, of all that their first samples see. One that a
/// pixel chose, of the same material and side, stands for any other that the pixel sees (docs/design/016).
class PixelPoints {
 public:
  /// Patches, or groups of them, that are a single tile: a pixel's samples may see many.
  static bool is_small(const scene::GridId& grid) { return grid.u_level + grid.v_level <= 4; }

  void clear();
  /// Chooses what a sample saw of a small patch, where fewer than `enough` have been chosen, or none of its material
  /// and side.
  void consider(const scene::Scene& scene, int pixel, int enough, const scene::GridPoint& point);
  /// To be called when all has been considered.
  void close() { std::sort(in_block_.begin(), in_block_.end()); }
  /// If the pixel has chosen `enough` patches, replaces *point by a point of one of them, chosen by `key`. A patch of
  /// one point that some pixel of the block has chosen stays.
  void lend(const scene::Scene& scene, int pixel, int enough, uint64_t key, scene::GridPoint* point) const;

 private:
  int count_[integrate::CameraBatch::capacity];
  scene::GridPoint chosen_[integrate::CameraBatch::capacity][GridNumbers::first_samples];
  std::vector<uint64_t> in_block_;  ///< hashes of the grids of one point that were chosen
};

}  // namespace dapple::distribution
