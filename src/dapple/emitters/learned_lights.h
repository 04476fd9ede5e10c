// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "dapple/emitters/light_tree.h"
#include "dapple/emitters/region_tree.h"
#include "dapple/emitters/sky_cells.h"

namespace dapple::emitters {

/// What was learned, before rendering, of the light that reaches each region of a scene, for drawing lights and
/// directions to the sky by it: which class of LightSampler gives how much, which of the lights at infinity, from which
/// cells of a sky, and which parts of the tree of the others. Only densities depend on it: with any values, as long as
/// shares and odds lie above zero, images have the same mean. Immutable, thread-safe.
class LearnedLights {
 public:
  /// A region's values, one after the other.
  struct Layout {
    int unbounded = 0, skies = 0, pairs = 0;
    static constexpr int per_sky = 1 + SkyCells::count;  ///< whether it is drawn by its cells, and their cdf
    int sky_at(int sky) const { return 1 + unbounded + sky * per_sky; }
    int odds_at() const { return sky_at(skies); }
    int size() const { return odds_at() + pairs; }
  };

  /// skies: lights, and their cells, in the order of the values. values: by region.
  LearnedLights(RegionTree regions, LightTree::Crown crown, int unbounded, std::vector<std::pair<int, SkyCells>> skies,
                std::vector<float> values, size_t light_count);

  /// Of a receiver: its own or that of a neighbour, by the key.
  LightRegion region(const LightReceiver& at, uint64_t key) const { return {this, values_of(regions_.near(at, key))}; }

  // Of a region.
  static float unbounded_share(const LightRegion& r) { return r.values[0]; }
  const float* unbounded_cdf(const LightRegion& r) const { return r.values + 1; }
  LightTree::Odds odds(const LightRegion& r) const { return {&crown_, r.values + layout_.odds_at()}; }

  /// Light::sample, sample_all and pdf of a light of the scene, to a receiver in a region.
  bool sample(const Light& light, int index, const LightReceiver& to, const V2f& u, LightSample* out) const {
    return sample_all(light, index, to, {&u, 1}, out) != 0;
  }
  uint32_t sample_all(const Light& light, int index, const LightReceiver& to, std::span<const V2f> u,
                      LightSample* out) const;
  float pdf(const Light& light, int index, const LightReceiver& to, const V3f& wi, const V3f& p_light,
            const V3f& n_light) const;

  const Layout& layout() const { return layout_; }
  const float* values_of(int region) const { return values_.data() + size_t(region) * size_t(layout_.size()); }

 private:
  /// The cdf of the cells of a light, where it is drawn by these; null: by itself.
  const float* cells_of(int index, const LightReceiver& to) const {
    const int sky = sky_of_[size_t(index)];
    if (sky < 0) return nullptr;
    const float* v = to.region.values + layout_.sky_at(sky);
    return v[0] > 0 ? v + 1 : nullptr;
  }

  RegionTree regions_;
  LightTree::Crown crown_;
  std::vector<std::pair<int, SkyCells>> skies_;
  Layout layout_;
  std::vector<float> values_;
  std::vector<int> sky_of_;  // by light; -1: none
};

/// Light::sample, sample_all and pdf of light `index` of a scene, by what is known of the receiver's region.
inline bool sample_light(const Light& light, int index, const LightReceiver& to, const V2f& u, LightSample* out) {
  return to.region ? to.region.lights->sample(light, index, to, u, out) : light.sample(to, u, out);
}
inline uint32_t sample_light(const Light& light, int index, const LightReceiver& to, std::span<const V2f> u,
                             LightSample* out) {
  return to.region ? to.region.lights->sample_all(light, index, to, u, out) : light.sample_all(to, u, out);
}
inline float light_pdf(const Light& light, int index, const LightReceiver& to, const V3f& wi, const V3f& p_light,
                       const V3f& n_light) {
  return to.region ? to.region.lights->pdf(light, index, to, wi, p_light, n_light)
                   : light.pdf(to, wi, p_light, n_light);
}

}  // namespace dapple::emitters
