// SPDX-License-Identifier: Apache-2.0
#include "dapple/media/nvdb_tree.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "dapple/media/nvdb_bytes.h"

namespace dapple::media {
namespace {

// Where things stand in a grid: its header, the header of the tree behind it, and the nodes.
constexpr uint64_t map_at = 296, matrix_at = map_at + 88, translation_at = map_at + 232;
constexpr uint64_t tree_at = 672, root_distance_at = tree_at + 24;
constexpr uint64_t root_count_at = 24, root_background_at = 28, root_size = 64;
constexpr uint64_t root_entry_size = 32, root_child_at = 8, root_state_at = 16, root_value_at = 20;
constexpr uint64_t value_mask_at = 32;  // of upper and lower nodes
constexpr uint64_t leaf_mask_at = 16, leaf_values_at = 96, leaf_bytes = 2144;
constexpr uint64_t release_step = uint64_t(1) << 22;

bool is_on(const char* mask, uint32_t i) {
  return (static_cast<unsigned char>(mask[i >> 3]) >> (i & 7)) & 1;
}

}  // namespace

/// Upper or lower nodes in the file.
struct NvdbTree::Level {
  const char* name;
  uint64_t bytes, child_mask_at, table_at;
  int edge_log, child_log;
  std::vector<uint32_t> SparseGrid::*entries;

  uint32_t count() const { return 1u << (3 * (edge_log - child_log)); }
};

void NvdbTree::fail(const std::string& what, uint64_t place) {
  throw std::runtime_error(what + ", at byte " + std::to_string(place) + " of it");
}

float NvdbTree::value(uint64_t place) {
  const float v = get<float>(place);
  if (!std::isfinite(v)) fail("has a value that is not finite", place);
  if (v < 0 && values_ == NvdbValues::from_zero) {
    ++grid_.negatives_;
    return 0;
  }
  grid_.max_ = std::max(grid_.max_, v);
  return v;
}

uint32_t NvdbTree::tile(float value) {
  if (value == grid_.background_) return 0;
  if (grid_.tiles_.back() != value) {
    if (grid_.tiles_.size() >= SparseGrid::is_node) fail("has too many values", 0);
    grid_.tiles_.push_back(value);
  }
  return uint32_t(grid_.tiles_.size() - 1);
}

uint64_t NvdbTree::follow(uint64_t node, int64_t distance) const {
  int64_t to = 0;
  if (__builtin_add_overflow(int64_t(node), distance, &to) || to < int64_t(tree_at) || uint64_t(to) >= bytes_.size())
    fail("points outside of itself", node);
  return uint64_t(to);
}

void NvdbTree::read_map() {
  M44d rows;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) rows[i][j] = get<double>(matrix_at + uint64_t(3 * i + j) * sizeof(double));
    rows[i][3] = get<double>(translation_at + uint64_t(i) * sizeof(double));
  }
  grid_.index_to_world_ = Transform(rows);
  if (!grid_.index_to_world_.is_finite() || !grid_.index_to_world_.is_invertible())
    fail("has a transform that cannot be inverted", matrix_at);
}

std::vector<NvdbTree::Child> NvdbTree::read_roots(uint64_t root) {
  const auto count = get<uint32_t>(root + root_count_at);
  if (root > bytes_.size() - std::min<uint64_t>(root_size, bytes_.size()) ||
      count > (bytes_.size() - root - root_size) / root_entry_size)
    fail("has a root of " + std::to_string(count) + " entries, more than it has bytes", root + root_count_at);
  grid_.background_ = value(root + root_background_at);
  grid_.tiles_.push_back(grid_.background_);
  struct Entry {
    SparseGrid::Root node;
    uint64_t place;
    int64_t distance;
  };
  std::vector<Entry> entries;
  entries.reserve(count);
  for (uint32_t i = 0; i < count; ++i) {
    const uint64_t place = root + root_size + i * root_entry_size;
    const auto key = get<uint64_t>(place);
    // Three coordinates of 21 bits; 20 of them say which node of 2^12 points, the sign is the highest.
    const auto coordinate = [&](int shift) {
      const auto bits = uint32_t((key >> shift) & 0x1fffff);
      if (bits >> 20) fail("has a root entry beyond 32 bits", place);
      return int(bits << 12) >> 12;
    };
    entries.push_back({{coordinate(42), coordinate(21), coordinate(0), 0}, place, get<int64_t>(place + root_child_at)});
  }
  const auto order = [](const Entry& e) { return std::tuple(e.node.x, e.node.y, e.node.z); };
  std::sort(entries.begin(), entries.end(), [&](const Entry& a, const Entry& b) { return order(a) < order(b); });
  std::vector<Child> children;
  grid_.roots_.reserve(count);
  for (const Entry& e : entries) {
    if (!grid_.roots_.empty() &&
        std::tuple(grid_.roots_.back().x, grid_.roots_.back().y, grid_.roots_.back().z) == order(e))
      fail("has two root entries for one place", e.place);
    SparseGrid::Root node = e.node;
    constexpr int edge = 1 << SparseGrid::upper_log;
    // Only half of 32 bits is for use, so that sums of coordinates do not overflow.
    if (std::max({std::abs(node.x), std::abs(node.y), std::abs(node.z)}) >= SparseGrid::most_coordinate / edge)
      fail("lies further than 2^30 voxels from its origin", e.place);
    const V3i origin(node.x * edge, node.y * edge, node.z * edge);
    if (e.distance != 0) {
      children.push_back({follow(root, e.distance), uint32_t(grid_.roots_.size()), origin});
    } else {
      node.entry = tile(value(e.place + root_value_at));
      if (get<uint32_t>(e.place + root_state_at) != 0) grid_.active_.add(origin, origin + V3i(edge, edge, edge));
    }
    grid_.roots_.push_back(node);
  }
  return children;
}

void NvdbTree::arrange(const Level& level, std::vector<Child>* nodes) const {
  if (nodes->size() > bytes_.size() / level.bytes)
    fail("has more " + std::string(level.name) + " than it has bytes", root_distance_at);
  std::sort(nodes->begin(), nodes->end(), [](const Child& a, const Child& b) { return a.offset < b.offset; });
  for (size_t i = 0; i < nodes->size(); ++i) {
    const uint64_t place = (*nodes)[i].offset, end = i + 1 < nodes->size() ? (*nodes)[i + 1].offset : bytes_.size();
    if (end - place >= level.bytes) continue;
    fail(i + 1 < nodes->size() ? "has " + std::string(level.name) + " that overlap"
                               : "ends within " + std::string(level.name),
         place);
  }
}

std::vector<NvdbTree::Child> NvdbTree::read_nodes(const Level& level, std::vector<Child> nodes, uint32_t* parents) {
  arrange(level, &nodes);
  std::vector<uint32_t>& entries = grid_.*level.entries;
  const uint32_t count = level.count();
  if (nodes.size() * count >= SparseGrid::is_node) fail("has too many " + std::string(level.name), 0);
  entries.reserve(nodes.size() * count);
  std::vector<Child> children;
  const int bits = level.edge_log - level.child_log, mask = (1 << bits) - 1, edge = 1 << level.child_log;
  const size_t most = bytes_.size() / leaf_bytes;
  for (size_t i = 0; i < nodes.size(); ++i) {
    const Child& node = nodes[i];
    const char* const at = bytes_.data() + node.offset;
    // Parents are roots, whose entries lie apart, or entries of the level above.
    parents[node.entry] = uint32_t(i) | SparseGrid::is_node;
    for (uint32_t n = 0; n < count; ++n) {
      const uint64_t place = node.offset + level.table_at + n * sizeof(int64_t);
      const V3i origin(node.origin.x + int(n >> (2 * bits)) * edge, node.origin.y + (int(n >> bits) & mask) * edge,
                       node.origin.z + (int(n) & mask) * edge);
      if (is_on(at + level.child_mask_at, n)) {
        if (children.size() >= most) fail("has more nodes than bytes for them", place);
        children.push_back({follow(node.offset, get<int64_t>(place)), uint32_t(entries.size()), origin});
        entries.push_back(0);
        continue;
      }
      entries.push_back(tile(value(place)));
      if (is_on(at + value_mask_at, n)) grid_.active_.add(origin, origin + V3i(edge, edge, edge));
    }
  }
  return children;
}

void NvdbTree::read_leaves(std::vector<Child> leaves) {
  const Level level{"leaves", leaf_bytes, 0, 0, SparseGrid::leaf_log, 0, nullptr};
  arrange(level, &leaves);
  grid_.voxels_.reserve(leaves.size() * SparseGrid::leaf_size);
  uint64_t released = leaves.empty() ? 0 : leaves.front().offset;
  for (size_t i = 0; i < leaves.size(); ++i) {
    const Child& leaf = leaves[i];
    grid_.lower_[leaf.entry] = uint32_t(i) | SparseGrid::is_node;
    for (uint32_t n = 0; n < SparseGrid::leaf_size; ++n)
      grid_.voxels_.push_back(value(leaf.offset + leaf_values_at + n * sizeof(float)));
    for (int x = 0; x < 8; ++x) {
      const auto slab = get<uint64_t>(leaf.offset + leaf_mask_at + uint64_t(x) * 8);
      for (int y = 0; slab != 0 && y < 8; ++y) {
        const auto row = unsigned(slab >> (8 * y)) & 255u;
        if (row == 0) continue;
        const V3i first(leaf.origin.x + x, leaf.origin.y + y, leaf.origin.z + __builtin_ctz(row));
        grid_.active_.add(first, V3i(first.x + 1, first.y + 1, leaf.origin.z + 32 - __builtin_clz(row)));
      }
    }
    if (may_release_ && leaf.offset - released > release_step) {
      Pages::release(bytes_.substr(released, leaf.offset - released));
      released = leaf.offset;
    }
  }
}

SparseGrid NvdbTree::read() {
  read_map();
  const uint64_t root = follow(tree_at, get<int64_t>(root_distance_at));
  std::vector<Child> uppers = read_roots(root);
  std::vector<uint32_t> of_roots(grid_.roots_.size());
  std::vector<bool> has_node(grid_.roots_.size());
  for (const Child& c : uppers) has_node[c.entry] = true;
  std::vector<Child> lowers =
      read_nodes({"upper nodes", 270400, 4128, 8256, SparseGrid::upper_log, SparseGrid::lower_log, &SparseGrid::upper_},
                 std::move(uppers), of_roots.data());
  for (size_t i = 0; i < of_roots.size(); ++i)
    if (has_node[i]) grid_.roots_[i].entry = of_roots[i];
  std::vector<Child> leaves =
      read_nodes({"lower nodes", 33856, 544, 1088, SparseGrid::lower_log, SparseGrid::leaf_log, &SparseGrid::lower_},
                 std::move(lowers), grid_.upper_.data());
  read_leaves(std::move(leaves));
  return std::move(grid_);
}

}  // namespace dapple::media
