// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dapple/emitters/light.h"

namespace dapple::emitters {

/// A binary tree over lights with a place, for choosing one (Conty Estevez & Kulla 2018, "Importance sampling of many
/// lights with adaptive tree splitting"; without the splitting).
///
/// A node knows a sphere around its lights, a cone around their normals and their summed intensity. At each node the
/// walk goes to a child in proportion to
///   intensity * cos(theta') * cos(theta_i') / (d^2 + r^2 / 8),
/// where theta' is the least angle between a normal and the direction to the receiver, theta_i' the least angle between
/// the receiver's normal and the sphere, d the distance to the centre and r the sphere's radius. It is zero only where
/// no light of the node can contribute. (The mean of 1/d^2 over the cube in such a sphere is about 8 / r^2 at its
/// centre; with the paper's r^2 the lights around a receiver got too few samples, and the variance of the test with a
/// thousand lights was three times as large.)
///
/// Built top-down over binned centroids by the surface-area-orientation heuristic of the paper, with the squared
/// diagonal for the area (points on a line have none). Immutable, thread-safe; the same lights give the same tree on
/// any number of threads.
class LightTree {
 public:
  struct Item {
    LightBounds bounds;  ///< finite, intensity > 0
    int light = 0;
  };

  LightTree() = default;
  /// `light_count`: above all items' light.
  LightTree(std::vector<Item> items, size_t light_count);

  bool empty() const { return nodes_.empty(); }
  size_t size() const { return (nodes_.size() + 1) / 2; }
  size_t bytes() const { return nodes_.capacity() * sizeof(Node) + trails_.capacity() * sizeof(uint64_t); }

  /// The light the walk ends at, multiplying *probability by that of the walk; -1 where nothing contributes. u in [0,
  /// 1).
  int select(const LightReceiver& to, double u, float* probability) const;
  /// What walks from one receiver have found out about the nodes near the root, which they all pass.
  class Walks {
   private:
    friend LightTree;
    static constexpr uint32_t slot_count = 64;
    uint32_t children[slot_count] = {};  ///< 0: none
    float first[slot_count];
  };
  /// The same for one receiver after another walk from there.
  int select(const LightReceiver& to, double u, float* probability, Walks* walks) const;
  /// `probability` times that of the walk to a light of the tree: what select() makes of it, to the last bit.
  float probability(const LightReceiver& to, int light, float probability) const;

  /// The nodes around the root. At each of its pairs of siblings, walks can be given odds of their own: the first's
  /// importance counts so many times. Where it ends, at its leaves, stands a light or a subtree.
  class Crown {
   public:
    int pairs() const { return int(pairs_.size()); }
    int leaves() const { return pairs() + 1; }
    /// What is below sibling i of a pair: another, or ~ of a leaf.
    int below(int pair, int i) const { return pairs_[size_t(pair)].below[i]; }

   private:
    friend LightTree;
    struct Pair {
      int32_t below[2];
    };
    std::vector<Pair> pairs_;  ///< [0] below the root, each before those below it
  };
  /// Of at most so many leaves: nodes of most intensity are split first.
  Crown crown(int most_leaves) const;
  /// The leaf that holds a light of the tree.
  int leaf_of(const Crown& crown, int light) const;
  /// Odds of each pair of a crown.
  struct Odds {
    const Crown* crown;
    const float* of_first;
  };
  /// select() and probability() with odds. One object of Walks is for the same odds.
  int select(const LightReceiver& to, double u, float* probability, const Odds& odds) const;
  int select(const LightReceiver& to, double u, float* probability, Walks* walks, const Odds& odds) const;
  float probability(const LightReceiver& to, int light, float probability, const Odds& odds) const;

  /// The least sqrt(d^2 + r^2) over strong lights (LightTreeNumbers::strong_share) that may contribute, of a sphere
  /// around each; `within` where there is none so near.
  float nearest(const LightReceiver& to, float within) const;
  /// Estimate of the luminous irradiance all lights together can give; zero only where there is none.
  float irradiance(const LightReceiver& to) const { return importance(nodes_[0], to) * intensity_scale_; }

 private:
  struct Node {
    V3f centre;
    float radius;
    V3f axis;
    float cos_o, sin_o;  // normal cone
    float cos_e;         // emission beyond a normal, with slack for round-off
    float intensity;     // over intensity_scale_
    uint32_t link;       // light, or the first of two adjacent children; and the flags below
  };
  static_assert(sizeof(Node) == 48);
  static constexpr uint32_t leaf_flag = 1u << 31, two_sided_flag = 1u << 30, link_mask = two_sided_flag - 1;
  static constexpr int max_depth = 63;  // bits of a trail

  class Builder;

  static Node make_node(const LightBounds& bounds, float intensity_scale);
  static float importance(const Node& node, const LightReceiver& to);
  /// Probability of the first of two adjacent nodes; -1 if neither contributes.
  float first_probability(uint32_t children, const LightReceiver& to, float odds = 1) const;
  float first_probability(uint32_t children, const LightReceiver& to, Walks* walks, float odds = 1) const;
  class OddsWalk;
  template <class First>
  int walk(double u, float* probability, const First& first_probability) const;
  template <class First>
  float walk_to(int light, float probability, const First& first_probability) const;

  std::vector<Node> nodes_;       // [0] is the root
  std::vector<uint64_t> trails_;  // of each light: bit d is set where the path takes the second child at depth d
  float intensity_scale_ = 1;
};

}  // namespace dapple::emitters
