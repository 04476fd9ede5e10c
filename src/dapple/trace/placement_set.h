// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dapple/base/vec.h"

namespace dapple::trace {

/// Places of one object: maps from its space to that in which it is placed, 48 bytes each. They lie by fours, so that a
/// ray is taken into the space of four at once.
class PlacementSet {
 public:
  static constexpr uint32_t width = 4;
  /// Of four placements: rows and columns of their maps. Lanes that are not used are zero.
  struct alignas(16) Block {
    float m[3][4][width];
  };

  void reserve(size_t placements) { blocks_.reserve((placements + width - 1) / width); }
  void add(const float rows[3][4]);
  uint32_t size() const { return size_; }
  void rows(uint32_t i, float out[3][4]) const;
  const std::vector<Block>& blocks() const { return blocks_; }
  /// Placements of a block.
  uint32_t lanes(uint32_t block) const { return block + 1 < blocks_.size() ? width : size_ - block * width; }
  size_t bytes() const { return blocks_.capacity() * sizeof(Block); }

  /// Sorts along a space-filling curve, so that fours lie together, and leaves out what stands in one place twice.
  /// Returns how many these were.
  uint32_t arrange();
  /// Where a block's placements put the box of their object.
  Box3f bounds(uint32_t block, const Box3f& object) const;

 private:
  void set_rows(uint32_t i, const float rows[3][4]);
  V3f origin(uint32_t i) const;
  uint32_t leave_out_repeated(const std::vector<uint64_t>& keys);

  std::vector<Block> blocks_;
  uint32_t size_ = 0;
};

/// Of a map's rows: the largest scale along an axis.
float largest_scale(const float rows[3][4]);

}  // namespace dapple::trace
