// SPDX-License-Identifier: Apache-2.0
#include "dapple/media/sparse_grid.h"

#include <algorithm>
#include <tuple>

namespace dapple::media {

void SparseGrid::Extent::add(const V3i& from, const V3i& to) {
  const bool first = empty();
  for (int k = 0; k < 3; ++k) {
    lo[k] = first ? from[k] : std::min(lo[k], from[k]);
    hi[k] = first ? to[k] : std::max(hi[k], to[k]);
  }
}

SparseGrid::Place SparseGrid::find(int x, int y, int z) const {
  const int rx = x >> upper_log, ry = y >> upper_log, rz = z >> upper_log;
  const auto root = std::lower_bound(roots_.begin(), roots_.end(), std::tuple(rx, ry, rz),
                                     [](const Root& r, const auto& key) { return std::tuple(r.x, r.y, r.z) < key; });
  if (root == roots_.end() || root->x != rx || root->y != ry || root->z != rz) return {nullptr, background_};
  const auto child = [&](uint32_t bits, int log) {
    const uint32_t mask = (1u << bits) - 1;
    return (((uint32_t(x) >> log) & mask) << (2 * bits)) | (((uint32_t(y) >> log) & mask) << bits) |
           ((uint32_t(z) >> log) & mask);
  };
  uint32_t entry = root->entry;
  if (entry & is_node) entry = upper_[size_t(entry & ~is_node) * upper_size + child(upper_log - lower_log, lower_log)];
  if (!(entry & is_node)) return {nullptr, tiles_[entry]};
  entry = lower_[size_t(entry & ~is_node) * lower_size + child(lower_log - leaf_log, leaf_log)];
  if (!(entry & is_node)) return {nullptr, tiles_[entry]};
  return {voxels_.data() + size_t(entry & ~is_node) * leaf_size, 0};
}

float SparseGrid::lookup(const V3f& p) const {
  const float fx = std::floor(p.x), fy = std::floor(p.y), fz = std::floor(p.z);
  const auto near = [](float v) { return std::abs(v) < float(most_coordinate); };
  if (!(near(fx) && near(fy) && near(fz))) return background_;
  const int x = int(fx), y = int(fy), z = int(fz);
  const float u = p.x - fx, v = p.y - fy, w = p.z - fz;
  float c[8];
  const auto all_of = [](int i) { return (i & 7) != 7; };
  if (all_of(x) && all_of(y) && all_of(z)) {  // one block has all corners
    const Place place = find(x, y, z);
    if (!place.block) return place.value;
    const float* b = place.block + local(x, y, z);
    c[0] = b[0], c[1] = b[1], c[2] = b[8], c[3] = b[9], c[4] = b[64], c[5] = b[65], c[6] = b[72], c[7] = b[73];
  } else {
    for (int i = 0; i < 8; ++i) c[i] = at(x + (i >> 2), y + ((i >> 1) & 1), z + (i & 1));
  }
  const auto mix = [](float a, float b, float t) { return a * (1 - t) + b * t; };
  return mix(mix(mix(c[0], c[1], w), mix(c[2], c[3], w), v), mix(mix(c[4], c[5], w), mix(c[6], c[7], w), v), u);
}

size_t SparseGrid::bytes() const {
  return roots_.capacity() * sizeof(Root) + (upper_.capacity() + lower_.capacity()) * sizeof(uint32_t) +
         (tiles_.capacity() + voxels_.capacity()) * sizeof(float);
}

}  // namespace dapple::media
