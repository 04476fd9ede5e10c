// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "dapple/emitters/learned_lights.h"

namespace dapple::light {

/// Between what light samples choose.
struct LightChoices {
  static constexpr size_t most_skies = 2;
  static constexpr int most_leaves = 64, most_others = 8;

  int unbounded = 0;  ///< lights of LightSampler::unbounded()
  std::vector<std::pair<int, emitters::SkyCells>> skies;
  std::vector<int> slot_of_sky;            ///< in LightSampler::unbounded()
  std::vector<int> others, slot_of_other;  ///< the rest of these
  const emitters::LightTree* tree = nullptr;
  emitters::LightTree::Crown crown;
  std::vector<int> leaf_of_light;

  emitters::LearnedLights::Layout layout() const { return {unbounded, int(skies.size()), crown.pairs()}; }
  /// Looked at from one point.
  int others_at_once() const { return std::min(int(others.size()), most_others); }
};

/// What a ray from a point to a light found.
struct LightSeen {
  uint32_t choice = 0;  ///< cell of a sky, or number among the others, or leaf of the crown
  float light = 0;  ///< luminous irradiance that arrives; of a cell, that of all of it; of a lamp, over the probability
                    ///< of the choice
  float own =
      0;  ///< sky: probability of the cell as the light draws by itself. lamp: `light`, if nothing were in the way
  float radiance = 0;  ///< sky: luminance
};

/// Sums, by region, of what was seen, and what to do about it.
class LightStatistics {
 public:
  LightStatistics(const LightChoices& choices, size_t regions);

  /// Of one point: rays to each of the skies, `rays` of them, to the others, to lamps.
  void add(int region, std::span<const LightSeen> seen, int rays);
  /// More of a point's rays, to cells of skies that were chosen anyhow, `rays` to each sky.
  void add_to_skies(int region, std::span<const LightSeen> seen, int rays);
  struct Learned {
    std::vector<float> values;  ///< LearnedLights'
    double gaining = 0;         ///< share of points in regions that have much less noise by them
  };
  Learned learned(const emitters::RegionTree& regions) const;

 private:
  // Of a sky's cell, or of another light at infinity: trials, squares of the light, chances to be drawn without
  // learning.
  struct Part {
    float trials = 0, sum = 0, square = 0, own = 0;

    void add(const LightSeen& s) {
      trials += 1;
      sum += s.light;
      square += s.light * s.light;
      own += s.own;
    }
    // Between mean and root of the mean square: of few trials, the latter tells little.
    float weight() const { return std::sqrt(sum * std::sqrt(square)); }
  };
  // Of a leaf of the crown: light that arrived, and that would if nothing were in the way; squared visibility, once
  // smoothed.
  struct Leaf {
    float arrived = 0, sent = 0;
  };
  // Radiance that a ray by the cosine finds in a sky.
  struct ByCosine {
    float sum = 0, square = 0;
  };

  Part* parts(int region) { return parts_.data() + size_t(region) * part_count_; }
  Leaf* leaves(int region) { return leaves_.data() + size_t(region) * leaf_count_; }
  const Part* parts(int region) const { return parts_.data() + size_t(region) * part_count_; }
  const Leaf* leaves(int region) const { return leaves_.data() + size_t(region) * leaf_count_; }
  const ByCosine* cosines(int region) const { return cosines_.data() + size_t(region) * choices_.skies.size(); }
  ByCosine* cosines(int region) { return cosines_.data() + size_t(region) * choices_.skies.size(); }
  void add_to_parent(int region, int parent);
  void lean_on(int region, int parent);
  /// What a region gets from lights, and whether the samples have much less noise.
  struct Worth {
    float light = 0;
    bool gains = false;
  };
  Worth sky_values(int region, size_t sky, float* out) const;
  Worth lamp_values(int region, float* odds) const;
  bool write(int region, float* out) const;

  const LightChoices& choices_;
  const size_t part_count_, leaf_count_;
  std::vector<float> points_;  ///< by region
  std::vector<Part> parts_;
  std::vector<Leaf> leaves_;
  std::vector<ByCosine> cosines_;
};

}  // namespace dapple::light
