// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/patch_clusters.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "dapple/base/hash.h"

namespace dapple::geom {

namespace {

// Orders patches [first, last) so that every aligned run of 2^k of them is compact: halves along the widest axis, the
// first half as many as the largest power of two that leaves some.
void order_by_halves(const std::vector<V3f>& centres, uint32_t* first, uint32_t* last) {
  while (last - first > 2) {
    Box3f box;
    for (const uint32_t* i = first; i != last; ++i) box.extendBy(centres[*i]);
    const unsigned axis = box.majorAxis();
    uint32_t* const middle = first + std::bit_ceil(size_t(last - first)) / 2;
    std::nth_element(first, middle, last, [&](uint32_t a, uint32_t b) {
      const float x = centres[a][int(axis)], y = centres[b][int(axis)];
      return x != y ? x < y : a < b;
    });
    order_by_halves(centres, middle, last);
    last = middle;
  }
}

}  // namespace

PatchClusters::PatchClusters(std::span<const Box3f> boxes, std::span<const float> areas)
    : rank_(boxes.size()), order_(boxes.size()), area_before_(boxes.size() + 1) {
  std::vector<V3f> centres;
  for (const Box3f& b : boxes) centres.push_back((b.min + b.max) * 0.5f);
  std::iota(order_.begin(), order_.end(), 0u);
  order_by_halves(centres, order_.data(), order_.data() + order_.size());
  for (uint32_t r = 0; r < order_.size(); ++r) {
    rank_[order_[r]] = r;
    area_before_[r + 1] = area_before_[r] + double(areas[order_[r]]);
  }

  std::vector<Box3f> groups;
  for (const uint32_t patch : order_) groups.push_back(boxes[patch]);
  while (groups.size() > 1) {
    std::vector<Box3f> next((groups.size() + 3) / 4);
    for (size_t i = 0; i < groups.size(); ++i) next[i / 4].extendBy(groups[i]);
    groups = std::move(next);
    std::vector<float>& diameters = diameters_.emplace_back();
    const size_t size = size_t(1) << (2 * diameters_.size());
    for (size_t g = 0; g < groups.size(); ++g)
      diameters.push_back(is_of_few(areas, g * size, size) ? HUGE_VALF : length(groups[g].max - groups[g].min));
  }
}

// Whether less than a third of a group's patches have its area, counted as (sum a)^2 / sum a^2.
bool PatchClusters::is_of_few(std::span<const float> areas, size_t first, size_t size) const {
  const size_t last = std::min(first + size, order_.size());
  double sum = 0, squares = 0;
  for (size_t rank = first; rank < last; ++rank) {
    const double area = double(areas[order_[rank]]);
    sum += area, squares += area * area;
  }
  return 3 * sum * sum < double(last - first) * squares;
}

uint32_t PatchClusters::representative(uint32_t group, int level, uint32_t choice) const {
  const size_t first = size_t(group) << (2 * level), last = std::min(order_.size(), first + (size_t(1) << (2 * level)));
  const uint64_t random = hash(group, level, choice);
  const double area = area_before_[last] - area_before_[first];
  if (!(area > 0) || !(area < HUGE_VAL)) return order_[first + random % (last - first)];
  const double at = area_before_[first] + area * double(to_unit_float(random));
  const auto begin = area_before_.begin();
  const auto after = std::upper_bound(begin + ptrdiff_t(first) + 1, begin + ptrdiff_t(last), at);
  return order_[size_t(after - begin) - 1];
}

bool PatchClusters::ends_of_part(uint32_t group, int level, int part, uint32_t ends[2]) const {
  const size_t size = size_t(1) << (2 * part_level(level)),
               first = (size_t(group) * size_t(parts(level)) + size_t(part)) * size;
  if (first >= order_.size()) return false;
  ends[0] = order_[first], ends[1] = order_[std::min(first + size, order_.size()) - 1];
  return true;
}

}  // namespace dapple::geom
