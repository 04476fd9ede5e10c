// SPDX-License-Identifier: Apache-2.0
#include "dapple/emitters/light_sampler.h"

#include <algorithm>

#include "dapple/base/hash.h"
#include "dapple/emitters/learned_lights.h"

namespace dapple::emitters {
namespace {

bool is_finite(const LightBounds& b) {
  return dapple::is_finite(b.box.min) && dapple::is_finite(b.box.max) && dapple::is_finite(b.axis) &&
         std::isfinite(length2(b.box.max - b.box.min));
}

/// A random number has 24 bits, a path through a deep tree asks for more: without these a light of probability below
/// 2^-24 could never be chosen at some receivers. They come from u and the receiver, so that over many receivers every
/// light gets its share.
double with_more_bits(float u, const V3f& p) {
  return double(u) + 0x1p-24 * to_unit_float(hash(u, p.x, p.y, p.z));
}

}  // namespace

LightSampler::LightSampler(std::span<const Light* const> lights, float scene_radius) : slots_(lights.size(), never) {
  if (!(scene_radius > 0)) scene_radius = 1;
  std::vector<LightTree::Item> items;
  std::vector<double> powers;
  for (size_t i = 0; i < lights.size(); ++i) {
    const int light = static_cast<int>(i);
    const std::optional<LightBounds> bounds = lights[i]->bounds();
    if (bounds && is_finite(*bounds)) {
      if (!(bounds->intensity > 0)) continue;
      slots_[i] = in_tree;
      items.push_back({*bounds, light});
      items.back().bounds.intensity = std::min(bounds->intensity, std::numeric_limits<float>::max());
    } else if (const float power = lights[i]->power(scene_radius); power > 0) {
      slots_[i] = static_cast<int>(unbounded_.size());
      unbounded_.push_back(light);
      powers.push_back(std::min(power, std::numeric_limits<float>::max()));
    }
  }
  tree_ = LightTree(std::move(items), lights.size());

  double sum = 0, below = 0;
  for (const double power : powers) sum += power;
  for (const double power : powers)
    cdf_.push_back(below += 0.5 / static_cast<double>(powers.size()) + 0.5 * power / sum);
  if (!cdf_.empty()) cdf_.back() = 1;
  const double irradiance = sum / (double(pi) * scene_radius * scene_radius);
  unbounded_irradiance_ = static_cast<float>(std::clamp(irradiance, 0.0, 1e30));
}

float LightSampler::share(const LightReceiver& to, int slot) const {
  if (to.region) {
    const float* cdf = to.region.lights->unbounded_cdf(to.region);
    return cdf[slot] - (slot > 0 ? cdf[slot - 1] : 0);
  }
  return static_cast<float>(cdf_[slot] - (slot > 0 ? cdf_[slot - 1] : 0));
}

float LightSampler::unbounded_probability(const LightReceiver& to) const {
  if (tree_.empty()) return 1;
  if (unbounded_.empty()) return 0;
  const float local = std::min(tree_.irradiance(to), 1e30f);
  if (local == 0) return 1;
  if (to.region) return LearnedLights::unbounded_share(to.region);
  return 0.25f + 0.5f * unbounded_irradiance_ / (unbounded_irradiance_ + local);
}

LightSampler::Selection LightSampler::select_unbounded(const LightReceiver& to, double u) const {
  if (unbounded_.empty()) return {};
  const auto slot_in = [&](const auto* cdf) { return std::upper_bound(cdf, cdf + unbounded_.size() - 1, u) - cdf; };
  const auto slot = to.region ? slot_in(to.region.lights->unbounded_cdf(to.region)) : slot_in(cdf_.data());
  return {unbounded_[slot], share(to, static_cast<int>(slot))};
}

LightSampler::Selection LightSampler::select(const LightReceiver& to, float u) const {
  const float p = unbounded_probability(to);
  if (to.region) {
    const LightTree::Odds odds = to.region.lights->odds(to.region);
    return select(to, u, p, [&](double v, float* probability) { return tree_.select(to, v, probability, odds); });
  }
  return select(to, u, p, [&](double v, float* probability) { return tree_.select(to, v, probability); });
}

void LightSampler::select(const LightReceiver& to, std::span<const float> u, Selection* out) const {
  const float p = unbounded_probability(to);
  LightTree::Walks walks;
  if (to.region) {
    const LightTree::Odds odds = to.region.lights->odds(to.region);
    for (size_t i = 0; i < u.size(); ++i)
      out[i] = select(to, u[i], p,
                      [&](double v, float* probability) { return tree_.select(to, v, probability, &walks, odds); });
    return;
  }
  for (size_t i = 0; i < u.size(); ++i)
    out[i] =
        select(to, u[i], p, [&](double v, float* probability) { return tree_.select(to, v, probability, &walks); });
}

// walk: of the tree.
template <class Walk>
LightSampler::Selection LightSampler::select(const LightReceiver& to, float u, float p, const Walk& walk) const {
  if (p == 1 && unbounded_.size() <= 1) return unbounded_.empty() ? Selection{} : Selection{unbounded_[0], 1};
  if (p == 0 && tree_.size() == 1) {
    Selection only{-1, 1};
    only.light = walk(0, &only.probability);
    return only;
  }
  if (tree_.empty()) return select_unbounded(to, u);
  double v = with_more_bits(u, to.p);
  if (v < p) {
    Selection chosen = select_unbounded(to, v / p);
    chosen.probability *= p;
    return chosen;
  }
  v = std::min((v - p) / (1 - double(p)), 1 - 0x1p-53);
  Selection chosen{-1, 1 - p};
  chosen.light = walk(v, &chosen.probability);
  return chosen.light < 0 ? Selection{} : chosen;
}

float LightSampler::probability(const LightReceiver& to, int light) const {
  const int slot = slots_[light];
  if (slot == never) return 0;
  const float p = unbounded_probability(to);
  if (slot != in_tree) return share(to, slot) * p;
  if (!(p < 1)) return 0;
  return to.region ? tree_.probability(to, light, 1 - p, to.region.lights->odds(to.region))
                   : tree_.probability(to, light, 1 - p);
}

size_t LightSampler::bytes() const {
  return tree_.bytes() + (slots_.capacity() + unbounded_.capacity()) * sizeof(int) + cdf_.capacity() * sizeof(double);
}

}  // namespace dapple::emitters
