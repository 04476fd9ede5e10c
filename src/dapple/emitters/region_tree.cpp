// SPDX-License-Identifier: Apache-2.0
#include "dapple/emitters/region_tree.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "dapple/base/hash.h"
#include "dapple/emitters/region_numbers.h"

namespace dapple::emitters {

int RegionTree::kind(const LightReceiver& at) {
  if (at.n == V3f(0, 0, 0)) return kinds - 1;
  const V3f a(std::abs(at.n.x), std::abs(at.n.y), std::abs(at.n.z));
  const int axis = a.x >= a.y && a.x >= a.z ? 0 : a.y >= a.z ? 1 : 2;
  return 2 * axis + (at.n[axis] < 0) + (at.transmits ? 6 : 0);
}

RegionTree::RegionTree(std::span<const LightReceiver> points) {
  Node& root = nodes_.emplace_back();
  parents_.push_back(-1);
  sides_.push_back(side_);
  root.region.fill(0);
  table_.resize(size_t(1) << 3 * top);
  if (points.empty()) return;
  Box3f box;
  for (const LightReceiver& at : points) box.extendBy(at.p);
  const V3f size = box.max - box.min;
  side_ = std::max({size.x, size.y, size.z, 1e-20f}) * 1.001f;
  sides_[0] = side_;
  corner_ = (box.min + box.max) * 0.5f - V3f(side_ * 0.5f);
  std::vector<int> inside(points.size());
  std::iota(inside.begin(), inside.end(), 0);
  build(0, points, inside, corner_, side_, 0);
  fill_table(0, 0, 0, 0, 0);
}

// Of the cubes of depth `top` in a node's, whose place among those of its depth is x, y, z.
void RegionTree::fill_table(int32_t node, int depth, int x, int y, int z) {
  const int32_t children = nodes_[size_t(node)].children;
  if (depth < top && children > 0) {
    for (int o = 0; o < 8; ++o)
      fill_table(children + o, depth + 1, 2 * x + (o & 1), 2 * y + (o >> 1 & 1), 2 * z + (o >> 2));
    return;
  }
  const int n = 1 << (top - depth);
  for (int k = z * n; k < (z + 1) * n; ++k)
    for (int j = y * n; j < (y + 1) * n; ++j)
      for (int i = x * n; i < (x + 1) * n; ++i) table_[size_t((k << top | j) << top | i)] = {node, depth};
}

// Makes regions of a node, whose `region` are those of the cube around, and the nodes below.
void RegionTree::build(size_t node, std::span<const LightReceiver> points, std::span<int> inside, const V3f& corner,
                       float side, int depth) {
  std::array<int, kinds> counts{};
  for (const int i : inside) ++counts[size_t(kind(points[size_t(i)]))];
  for (size_t k = 0; k < kinds; ++k) {
    if (counts[k] < RegionNumbers::least_points) continue;
    parents_.push_back(nodes_[node].region[k]);
    sides_.push_back(side);
    nodes_[node].region[k] = int32_t(parents_.size()) - 1;
  }
  if (inside.size() <= RegionNumbers::most_points || depth == max_depth) return;
  const float half = side / 2;
  const V3f middle = corner + V3f(half);
  const auto octant = [&](int i) {
    const V3f& p = points[size_t(i)].p;
    return (p.x >= middle.x) + 2 * (p.y >= middle.y) + 4 * (p.z >= middle.z);
  };
  std::stable_sort(inside.begin(), inside.end(), [&](int i, int j) { return octant(i) < octant(j); });
  const size_t children = nodes_.size();
  Node child;
  child.region = nodes_[node].region;
  nodes_.resize(children + 8, child);
  nodes_[node].children = int32_t(children);
  for (int o = 0, begin = 0, end = 0; o < 8; ++o, begin = end) {
    while (end < int(inside.size()) && octant(inside[size_t(end)]) == o) ++end;
    const V3f from = corner + V3f(o & 1 ? half : 0, o & 2 ? half : 0, o & 4 ? half : 0);
    build(children + size_t(o), points, inside.subspan(size_t(begin), size_t(end - begin)), from, half, depth + 1);
  }
}

const RegionTree::Node& RegionTree::node_at(const V3f& p, float* side) const {
  // Bit by bit from the top, the coordinates say which child comes next.
  constexpr float cubes = float(1 << max_depth);
  const V3f q = (p - corner_) * (cubes / side_);
  const auto digits = [](float v) { return int(std::clamp(v, 0.0f, cubes - 1)); };
  const int x = digits(q.x), y = digits(q.y), z = digits(q.z);
  constexpr int below = max_depth - top;
  const Start start = table_[size_t((z >> below << top | y >> below) << top | x >> below)];
  const Node* node = &nodes_[size_t(start.node)];
  int depth = start.depth;
  for (; node->children > 0; ++depth) {
    const int bit = max_depth - 1 - depth;
    node = &nodes_[size_t(node->children + (x >> bit & 1) + 2 * (y >> bit & 1) + 4 * (z >> bit & 1))];
  }
  if (side) *side = side_ / float(1 << depth);
  return *node;
}

int RegionTree::near(const LightReceiver& at, uint64_t key) const {
  float side = 0;
  node_at(at.p, &side);
  KeyedRng rng(key);
  const float x = rng.next(), y = rng.next(), z = rng.next();
  LightReceiver moved = at;
  moved.p += V3f(x - 0.5f, y - 0.5f, z - 0.5f) * (2 * RegionNumbers::reach * side);
  return home(moved);
}

}  // namespace dapple::emitters
