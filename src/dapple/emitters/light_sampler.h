// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "dapple/emitters/light.h"
#include "dapple/emitters/light_tree.h"

namespace dapple::emitters {

/// Chooses one light for a receiver, with a probability that follows what each light is likely to contribute
/// unoccluded.
///
/// Lights with a place are in a LightTree. Lights at infinity are one class beside it, which gets the probability
///   1/4 + 1/2 E_inf / (E_inf + E_tree),
/// where E are estimates of irradiance: within a factor of two of a coin toss, because occlusion is unknown (a sky
/// behind a window, a lamp behind a wall). Inside the class, half is shared evenly and half in proportion to power.
///
/// Where LightReceiver::region knows what reaches a part of the scene, its shares take the place of those of the class
/// and in it, and its odds guide the walk.
///
/// Lights without power are never chosen. Probabilities add up to one, less the share of walks in the tree that end at
/// a node both of whose children turn out to contribute nothing (select() then returns light -1). Wherever a light may
/// contribute its probability is above zero. Immutable, thread-safe.
class LightSampler {
 public:
  struct Selection {
    int light = -1;  ///< index into the lights given; -1: none, nothing arrives
    float probability = 0;
  };

  LightSampler() = default;
  /// The lights are not used after construction. scene_radius (m): of a sphere around the scene.
  LightSampler(std::span<const Light* const> lights, float scene_radius);

  /// u uniform in [0, 1).
  Selection select(const LightReceiver& to, float u) const;
  /// The same for each of several u, for less.
  void select(const LightReceiver& to, std::span<const float> u, Selection* out) const;
  /// The probability with which select() returns this light.
  float probability(const LightReceiver& to, int light) const;

  /// LightTree::nearest: over how much space light from the nearest source changes, and no more than `within`.
  float nearest(const LightReceiver& to, float within) const {
    return tree_.empty() ? within : tree_.nearest(to, within);
  }

  const LightTree& tree() const { return tree_; }
  /// The lights at infinity, or without a finite place, that have power.
  std::span<const int> unbounded() const { return unbounded_; }

  size_t bytes() const;

 private:
  static constexpr int never = -2, in_tree = -1;

  float unbounded_probability(const LightReceiver& to) const;
  Selection select_unbounded(const LightReceiver& to, double u) const;
  template <class Walk>
  Selection select(const LightReceiver& to, float u, float unbounded_probability, const Walk& walk) const;
  float share(const LightReceiver& to, int slot) const;  // of one light in its class

  LightTree tree_;
  std::vector<int> slots_;      // of each light: place in unbounded_, or never, or in_tree
  std::vector<int> unbounded_;  // lights
  std::vector<double> cdf_;     // of unbounded_; the last is 1
  float unbounded_irradiance_ = 0;
};

}  // namespace dapple::emitters
