// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "dapple/forest/slab_tile.h"

namespace dapple::forest {

/// Where the rays of several directions are at each level, laid side by side, so that the rays that a receiver sends
/// go through a tile together.
class SlabPaths {
 public:
  static constexpr int most_rays = 64;

  SlabPaths() = default;
  /// levels: a multiple of 64, as many as any tile has that they are used for. std::invalid_argument for more rays than
  /// most_rays.
  SlabPaths(std::span<const SlabStep> rays, int levels);

  int rays() const { return rays_; }
  int levels() const { return int(first_part_.size() - 1) * SlabTile::word_bits; }
  SlabStep step(int ray) const {
    const size_t i = size_t(ray);
    return {sx_[i], sy_[i], gx_[i], gy_[i]};
  }

 private:
  friend class TilePaths;

  // A part of a path is where it stays in one pixel, within one word. All rays have as many parts in a word; those that
  // are too many have no levels.
  int rays_ = 0;
  std::vector<float> sx_, sy_, gx_, gy_;
  std::vector<int> first_part_{0};     ///< by word, and the end
  std::vector<int16_t> dx_, dy_;       ///< drift, by part and ray
  std::vector<uint64_t> part_levels_;  ///< likewise
};

/// Paths in the layout of a tile. Both must outlive this.
class TilePaths {
 public:
  /// paths must have the tile's levels.
  TilePaths(const SlabPaths& paths, const SlabTile& tile);

  /// How many rays meet nothing in levels [from, below[i]), and in those between from and the start of its word. Ray
  /// i's pixel of level 0 is (px[i], py[i]); its path must stay in the tile over all words from from's to that of the
  /// largest below.
  int passing(int channel, const int* px, const int* py, int from, const int* below) const;

 private:
  const SlabPaths& paths_;
  const SlabTile& tile_;
  std::vector<int32_t> offset_;  ///< of words from that of level 0's pixel, by part and ray; from first_word on
};

}  // namespace dapple::forest
