// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "dapple/media/sparse_grid.h"

namespace dapple::media {

/// What values below zero are: taken as 0 and counted, or kept.
enum class NvdbValues { from_zero, any };

/// Reads the tree of one grid of NanoVDB's format, version 32, as floats: from its bytes, of which none is trusted. The
/// tree is copied level by level, each in the order of the bytes; nodes of one level may not overlap, so that the copy
/// is never larger than the grid. Errors are
/// std::runtime_error: what the grid does, with the place in it.
class NvdbTree {
 public:
  /// `bytes`: from the grid's header to its end. `may_release`: pages of it may be given back (Pages::release).
  NvdbTree(std::string_view bytes, NvdbValues values, bool may_release)
      : bytes_(bytes), values_(values), may_release_(may_release) {}

  SparseGrid read();

 private:
  struct Child {
    uint64_t offset;
    uint32_t entry;  // of its parent's level
    V3i origin;
  };
  struct Level;

  [[noreturn]] static void fail(const std::string& what, uint64_t place);
  template <class T>
  T get(uint64_t place) const {
    T value;
    if (place > bytes_.size() || bytes_.size() - place < sizeof value) fail("ends too early", bytes_.size());
    std::memcpy(&value, bytes_.data() + place, sizeof value);
    return value;
  }
  float value(uint64_t place);
  uint32_t tile(float value);
  uint64_t follow(uint64_t node, int64_t distance) const;
  void read_map();
  std::vector<Child> read_roots(uint64_t root);
  std::vector<Child> read_nodes(const Level& level, std::vector<Child> nodes, uint32_t* parents);
  void read_leaves(std::vector<Child> leaves);
  void arrange(const Level& level, std::vector<Child>* nodes) const;

  std::string_view bytes_;
  const NvdbValues values_;
  const bool may_release_;
  SparseGrid grid_;
};

}  // namespace dapple::media
