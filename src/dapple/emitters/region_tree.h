// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "dapple/emitters/light.h"

namespace dapple::emitters {

/// Space in cubes, smaller where given points are denser: an octree. Each of its cubes holds a region for each of the
/// main directions that surfaces face, apart for those that transmit, and one for media; so both sides of a wall are
/// told apart. Immutable, thread-safe.
class RegionTree {
 public:
  static constexpr int kinds = 13;

  RegionTree() = default;
  /// The same for any order of threads; depends on the order of points.
  explicit RegionTree(std::span<const LightReceiver> points);

  size_t size() const { return parents_.size(); }
  /// Regions come after their parents; -1: the region, 0, of everything.
  int parent(int region) const { return parents_[size_t(region)]; }
  float side(int region) const { return sides_[size_t(region)]; }  ///< of its cube
  /// Where a point belongs.
  int home(const LightReceiver& at) const { return node_at(at.p, nullptr).region[size_t(kind(at))]; }
  /// home(), or a neighbour: by random numbers of a key, so that images do not show where regions end. The same for the
  /// same key.
  int near(const LightReceiver& at, uint64_t key) const;

 private:
  struct Node {
    int32_t children = 0;  ///< the first of eight; 0: none
    std::array<int32_t, kinds> region;
  };
  static constexpr int max_depth = 12;
  static constexpr int top = 4;  ///< levels that a table saves from walking through

  static int kind(const LightReceiver& at);
  const Node& node_at(const V3f& p, float* side) const;
  void build(size_t node, std::span<const LightReceiver> points, std::span<int> inside, const V3f& corner, float side,
             int depth);

  void fill_table(int32_t node, int depth, int x, int y, int z);

  struct Start {
    int32_t node = 0, depth = 0;
  };
  std::vector<Start> table_;  // by cube of depth `top`
  V3f corner_{0, 0, 0};
  float side_ = 1;
  std::vector<Node> nodes_;
  std::vector<int> parents_;
  std::vector<float> sides_;
};

}  // namespace dapple::emitters
