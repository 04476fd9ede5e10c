// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dapple/base/vec.h"

namespace dapple::geom {

/// Groups of neighbouring patches, for meshes that are finer than their shading: level k holds groups of 4^k patches,
/// from halving the mesh along its widest axis again and again. One patch stands for its group.
class PatchClusters {
 public:
  /// Bounds and areas of the patches.
  PatchClusters(std::span<const Box3f> boxes, std::span<const float> areas);

  int levels() const { return int(diameters_.size()); }
  uint32_t group(uint32_t patch, int level) const { return uint32_t(uint64_t(rank_[patch]) >> (2 * level)); }
  /// Diagonal of the group's box, level >= 1. Infinite where a few of its patches have most of its area, as the panels
  /// of a wall beside the mouldings of its windows: those are as large as the group, and lie on both sides of a house.
  float diameter(uint32_t group, int level) const { return diameters_[size_t(level - 1)][group]; }
  /// A patch that may stand for a group: any of it, chosen by a hash with a chance in proportion to its area.
  uint32_t representative(uint32_t group, int level, uint32_t choice) const;
  /// Groups consist of parts, as large as each other but for the last: single patches at level 1, else groups of two
  /// levels less.
  static int part_level(int level) { return level < 2 ? 0 : level - 2; }
  static constexpr int most_parts = 16;
  static int parts(int level) { return level < 2 ? 4 : most_parts; }
  /// Part of its group of this level in which a patch is.
  int part(uint32_t patch, int level) const { return int(group(patch, part_level(level)) % uint32_t(parts(level))); }
  /// The first and the last patch of that part, which lie at its opposite ends; false where the last group ends before
  /// it.
  bool ends_of_part(uint32_t group, int level, int part, uint32_t ends[2]) const;

 private:
  bool is_of_few(std::span<const float> areas, size_t first, size_t size) const;

  std::vector<uint32_t> rank_;                 ///< place of each patch in the order of halves
  std::vector<uint32_t> order_;                ///< inverse of rank_
  std::vector<double> area_before_;            ///< by rank, of all patches of lower rank; one more than patches
  std::vector<std::vector<float>> diameters_;  ///< from level 1
};

}  // namespace dapple::geom
