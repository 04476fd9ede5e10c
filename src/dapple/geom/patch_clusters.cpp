// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/patch_clusters.h"

#include <numeric>

#include "dapple/base/hash.h"

namespace dapple::geom {

namespace {

// Spreads the low 21 bits of x to every third bit.
uint64_t spread(uint64_t x) {
  x = (x | x << 32) & 0x001f00000000ffffull;
  x = (x | x << 16) & 0x001f0000ff0000ffull;
  x = (x | x << 8) & 0x100f00f00f00f00full;
  x = (x | x << 4) & 0x10c30c30c30c30c3ull;
  return (x | x << 2) & 0x1249249249249249ull;
}

uint64_t morton(const V3f& p, const Box3f& box, float scale) {
  const auto digit = [&](int i) { return uint64_t(std::clamp((p[i] - box.min[i]) * scale, 0.0f, 2097151.0f)); };
  return spread(digit(0)) | spread(digit(1)) << 1 | spread(digit(2)) << 2;
}

}  // namespace

PatchClusters::PatchClusters(std::span<const Box3f> boxes) : rank_(boxes.size()), order_(boxes.size()) {
  Box3f all;
  for (const Box3f& b : boxes) all.extendBy(b);
  const V3f size = all.max - all.min;
  const float widest = std::max({size.x, size.y, size.z});
  const float scale = widest > 0 && widest < infinity ? 2097151.0f / widest : 0;
  std::vector<uint64_t> codes(boxes.size());
  for (size_t i = 0; i < boxes.size(); ++i) codes[i] = morton((boxes[i].min + boxes[i].max) * 0.5f, all, scale);
  std::iota(order_.begin(), order_.end(), 0u);
  std::stable_sort(order_.begin(), order_.end(), [&](uint32_t a, uint32_t b) { return codes[a] < codes[b]; });
  for (uint32_t r = 0; r < order_.size(); ++r) rank_[order_[r]] = r;

  std::vector<Box3f> groups;
  for (const uint32_t patch : order_) groups.push_back(boxes[patch]);
  while (groups.size() > 1) {
    std::vector<Box3f> next((groups.size() + 3) / 4);
    for (size_t i = 0; i < groups.size(); ++i) next[i / 4].extendBy(groups[i]);
    groups = std::move(next);
    std::vector<float>& diameters = diameters_.emplace_back();
    for (const Box3f& b : groups) diameters.push_back(length(b.max - b.min));
  }
}

uint32_t PatchClusters::representative(uint32_t group, int level) const {
  const size_t first = size_t(group) << (2 * level), last = std::min(order_.size(), first + (size_t(1) << (2 * level)));
  return order_[first + hash(group, level) % (last - first)];
}

size_t PatchClusters::bytes() const {
  size_t bytes = (rank_.capacity() + order_.capacity()) * 4;
  for (const auto& d : diameters_) bytes += d.capacity() * 4;
  return bytes;
}

}  // namespace dapple::geom
