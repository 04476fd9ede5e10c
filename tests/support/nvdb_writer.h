// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <blosc.h>
#include <zlib.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <vector>

namespace dapple::test {

/// Writes NanoVDB files, version 32.4, of floats: voxels and tiles are set one by one.
class NvdbWriter {
 public:
  using Point = std::array<int, 3>;
  std::string name = "density";
  float background = 0;
  std::array<double, 9> matrix{1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< rows; from index to world space
  std::array<double, 3> translation{};
  uint32_t type = 1, grid_class = 2, version = (32u << 21) | (4u << 10);

  void set(const Point& p, float v, bool active = true) {
    Node& leaf = nodes_[0].try_emplace(shifted(p, 3), Node(512, background)).first->second;
    const uint32_t n = uint32_t(((p[0] & 7) << 6) | ((p[1] & 7) << 3) | (p[2] & 7));
    leaf.values[n] = v, leaf.active[n] = active;
  }
  /// All of the 8^3, 128^3 or 4096^3 voxels (log 3, 7 or 12) that p is one of. No voxel may be set there.
  void tile(const Point& p, int log, float v, bool active = true) {
    if (log == 12)
      roots_[shifted(p, 12)] = {v, active};
    else
      entry(log == 3 ? 1 : 2, p, v, active);
  }

  /// From the grid's header to its end.
  std::string grid() const {
    std::vector<std::map<Point, Node>> nodes(nodes_.begin(), nodes_.end());
    for (int level = 0; level < 2; ++level)  // parents
      for (const auto& [at, node] : nodes[size_t(level)])
        nodes[size_t(level) + 1].try_emplace(shifted(at, bits[level + 1]), Node(sizes[level + 1], background));
    const size_t root_count = nodes[2].size() + roots_.size();
    std::array<uint64_t, 3> first{};
    uint64_t end = 736 + 64 + 32 * root_count;
    for (int level = 2; level >= 0; --level)
      first[size_t(level)] = end, end += bytes[level] * nodes[size_t(level)].size();
    std::string out(end, '\0');
    write_header(&out);
    for (int level = 0; level < 3; ++level) {
      put(&out, 672 + 8 * size_t(level), first[size_t(level)] - 672);
      put(&out, 672 + 32 + 4 * size_t(level), uint32_t(nodes[size_t(level)].size()));
    }
    put(&out, 672 + 24, uint64_t(64));
    put(&out, 736 + 24, uint32_t(root_count));
    put(&out, 736 + 28, background);
    size_t place = 736 + 64;
    const auto key = [](const Point& p) {
      return (uint64_t(uint32_t(p[0]) & 0xfffff) << 42) | (uint64_t(uint32_t(p[1]) & 0xfffff) << 21) |
             uint64_t(uint32_t(p[2]) & 0xfffff);
    };
    for (const auto& [at, tile] : roots_) {
      put(&out, place, key(at));
      put(&out, place + 16, uint32_t(tile.active));
      put(&out, place + 20, tile.value);
      place += 32;
    }
    uint64_t node_place = first[2];
    for (const auto& [at, node] : nodes[2]) {
      put(&out, place, key(at));
      put(&out, place + 8, int64_t(node_place) - 736);
      place += 32, node_place += bytes[2];
    }
    for (int level = 2; level >= 0; --level) write_level(&out, nodes, level, first);
    return out;
  }

 private:
  static constexpr uint64_t bytes[3] = {2144, 33856, 270400}, table_at[3] = {96, 1088, 8256}, mask_at[3] = {16, 32, 32};
  static constexpr uint64_t child_mask_at[3] = {0, 544, 4128};
  static constexpr int bits[3] = {3, 4, 5};
  static constexpr size_t sizes[3] = {512, 4096, 32768};

  struct Node {
    std::vector<float> values;
    std::vector<bool> active;
    Node(size_t n, float v) : values(n, v), active(n) {}
  };
  struct Tile {
    float value;
    bool active;
  };

  static Point shifted(const Point& p, int by) { return {p[0] >> by, p[1] >> by, p[2] >> by}; }
  static uint32_t index(const Point& p, int log) {
    const int m = (1 << log) - 1;
    return uint32_t(((p[0] & m) << (2 * log)) | ((p[1] & m) << log) | (p[2] & m));
  }
  template <class T>
  static void put(std::string* out, size_t place, T v) {
    std::memcpy(out->data() + place, &v, sizeof v);
  }
  void entry(int level, const Point& p, float v, bool active) {
    const int below = level == 1 ? 3 : 7;
    Node& node = nodes_[size_t(level)]
                     .try_emplace(shifted(p, below + bits[level]), Node(sizes[level], background))
                     .first->second;
    const uint32_t n = index(shifted(p, below), bits[level]);
    node.values[n] = v, node.active[n] = active;
  }
  void write_header(std::string* out) const {
    put(out, 0, uint64_t(0x304244566f6e614e));
    put(out, 16, version);
    put(out, 32, uint64_t(out->size()));
    std::memcpy(out->data() + 40, name.data(), name.size());
    for (size_t i = 0; i < 9; ++i) put(out, 296 + 88 + 8 * i, matrix[i]);
    for (size_t i = 0; i < 3; ++i) put(out, 296 + 232 + 8 * i, translation[i]);
    put(out, 632, grid_class);
    put(out, 636, type);
  }
  static void write_level(std::string* out, const std::vector<std::map<Point, Node>>& nodes, int level,
                          const std::array<uint64_t, 3>& first) {
    uint64_t place = first[size_t(level)];
    for (const auto& [at, node] : nodes[size_t(level)]) {
      for (size_t n = 0; n < node.values.size(); ++n) {
        put(out, place + table_at[level] + n * (level == 0 ? 4 : 8), node.values[n]);
        if (node.active[n]) (*out)[place + mask_at[level] + n / 8] |= char(1 << (n % 8));
      }
      place += bytes[level];
    }
    if (level == 0) return;
    uint64_t child = first[size_t(level) - 1];
    for (const auto& [at, node] : nodes[size_t(level) - 1]) {
      const auto parent = nodes[size_t(level)].find(shifted(at, bits[level]));
      const uint64_t from =
          first[size_t(level)] + bytes[level] * uint64_t(std::distance(nodes[size_t(level)].begin(), parent));
      const uint32_t n = index(at, bits[level]);
      put(out, from + table_at[level] + n * 8, int64_t(child) - int64_t(from));
      (*out)[from + child_mask_at[level] + n / 8] |= char(1 << (n % 8));
      child += bytes[level - 1];
    }
  }

  std::array<std::map<Point, Node>, 3> nodes_;  // leaves, lower and upper nodes
  std::map<Point, Tile> roots_;
};

/// A file of one segment; codec 0 none, 1 zip, 2 blosc.
inline std::string nvdb_file(const std::vector<NvdbWriter>& grids, uint16_t codec = 0) {
  std::string head, body;
  const auto put = [](std::string* out, const auto& v) { out->append(reinterpret_cast<const char*>(&v), sizeof v); };
  head += "NanoVDB0";
  put(&head, (32u << 21) | (4u << 10));
  put(&head, uint16_t(grids.size()));
  put(&head, codec);
  for (const NvdbWriter& g : grids) {
    const std::string grid = g.grid();
    std::string packed = grid;
    if (codec == 1) {
      uLongf size = compressBound(uLong(grid.size()));
      packed.resize(size);
      compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(grid.data()),
               uLong(grid.size()));
      packed.resize(size);
    } else if (codec == 2) {
      packed.resize(grid.size() + BLOSC_MAX_OVERHEAD);
      packed.resize(size_t(
          blosc_compress_ctx(9, 1, 4, grid.size(), grid.data(), packed.data(), packed.size(), "lz4", 1 << 18, 1)));
    }
    if (codec != 0) {
      std::string size;
      put(&size, uint64_t(packed.size()));
      packed = size + packed;
    }
    std::string meta;
    put(&meta, uint64_t(grid.size()));
    put(&meta, uint64_t(packed.size()));
    meta.resize(32);
    put(&meta, g.type);
    put(&meta, g.grid_class);
    meta.resize(136);
    put(&meta, uint32_t(g.name.size() + 1));
    meta.resize(176);
    head += meta + g.name + '\0';
    body += packed;
  }
  return head + body;
}

}  // namespace dapple::test
