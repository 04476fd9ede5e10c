// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "dapple/base/transform.h"
#include "dapple/base/vec.h"

namespace dapple::media {

using V3i = Imath::V3i;

/// A scalar at every point of an integer lattice, most of it constant: blocks of 8^3 values in a tree of 16^3 blocks,
/// of 32^3 of those, and a sorted list of these (Museth 2013, "VDB: High-resolution sparse volumes with dynamic
/// topology"). A node's entry is another node or a tile, one value for all below it. Trilinear between lattice points,
/// as pbrt-v4 reads such grids. Immutable once made by read_nvdb (nvdb_file.h).
class SparseGrid {
 public:
  static constexpr int leaf_log = 3, lower_log = 7, upper_log = 12;  ///< of the lattice points along a node's edge
  static constexpr uint32_t leaf_size = 512, lower_size = 4096, upper_size = 32768;  ///< entries
  /// Lattice points that count are within this of 0.
  static constexpr int most_coordinate = 1 << 30;

  /// Value at a point of index space: that of lattice point i is at i.
  float lookup(const V3f& p) const;
  float at(int x, int y, int z) const {
    const Place place = find(x, y, z);
    return place.block ? place.block[local(x, y, z)] : place.value;
  }

  /// Lattice points that are active: those from `lo` up to and without `hi`. lo == hi where there are none.
  struct Extent {
    V3i lo{0, 0, 0}, hi{0, 0, 0};
    bool empty() const { return lo.x >= hi.x; }
    void add(const V3i& from, const V3i& to);
  };
  const Extent& active() const { return active_; }
  const Transform& index_to_world() const { return index_to_world_; }  ///< the file's own
  float background() const { return background_; }
  float max() const { return max_; }                 ///< of all values
  uint64_t negatives() const { return negatives_; }  ///< values below zero that were taken as 0
  size_t bytes() const;

  /// Calls block(origin, 512 values, z fastest) with every block, and tile(origin, edge, value) with every tile that is
  /// not the background.
  template <class Block, class Tile>
  void visit(const Block& block, const Tile& tile) const;

 private:
  friend class NvdbTree;
  // The index of a node of the next level, or that of a value in tiles_.
  static constexpr uint32_t is_node = 0x80000000u;
  struct Root {
    int x, y, z;  // in units of upper nodes
    uint32_t entry;
  };
  struct Place {
    const float* block;  // or null, and
    float value;
  };

  static size_t local(int x, int y, int z) { return size_t(((x & 7) << 6) | ((y & 7) << 3) | (z & 7)); }
  Place find(int x, int y, int z) const;

  std::vector<Root> roots_;  // in order of x, y, z
  std::vector<uint32_t> upper_, lower_;
  std::vector<float> tiles_;  // the first is the background
  std::vector<float> voxels_;
  float background_ = 0, max_ = 0;
  uint64_t negatives_ = 0;
  Extent active_;
  Transform index_to_world_;
};

template <class Block, class Tile>
void SparseGrid::visit(const Block& block, const Tile& tile) const {
  const auto value = [&](const V3i& origin, int log, uint32_t entry) {
    if (tiles_[entry] != background_) tile(origin, 1 << log, tiles_[entry]);
  };
  const auto child_origin = [](const V3i& origin, uint32_t n, int bits, int log) {
    const int mask = (1 << bits) - 1;
    return V3i(origin.x + (int((n >> (2 * bits))) & mask) * (1 << log), origin.y + (int(n >> bits) & mask) * (1 << log),
               origin.z + (int(n) & mask) * (1 << log));
  };
  for (const Root& root : roots_) {
    const V3i origin(root.x * (1 << upper_log), root.y * (1 << upper_log), root.z * (1 << upper_log));
    if (!(root.entry & is_node)) {
      value(origin, upper_log, root.entry);
      continue;
    }
    const uint32_t* upper = upper_.data() + size_t(root.entry & ~is_node) * upper_size;
    for (uint32_t i = 0; i < upper_size; ++i) {
      const V3i at = child_origin(origin, i, upper_log - lower_log, lower_log);
      if (!(upper[i] & is_node)) {
        value(at, lower_log, upper[i]);
        continue;
      }
      const uint32_t* lower = lower_.data() + size_t(upper[i] & ~is_node) * lower_size;
      for (uint32_t j = 0; j < lower_size; ++j) {
        const V3i leaf = child_origin(at, j, lower_log - leaf_log, leaf_log);
        if (lower[j] & is_node)
          block(leaf, voxels_.data() + size_t(lower[j] & ~is_node) * leaf_size);
        else
          value(leaf, leaf_log, lower[j]);
      }
    }
  }
}

}  // namespace dapple::media
