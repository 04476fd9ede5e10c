// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/learned_lights.h"

#include <algorithm>

namespace dapple::shading {

LearnedLights::LearnedLights(RegionTree regions, LightTree::Crown crown, int unbounded, std::vector<std::pair<int, SkyCells>> skies,
                             std::vector<float> values, size_t light_count)
    : regions_(std::move(regions)),
      crown_(std::move(crown)),
      skies_(std::move(skies)),
      layout_{unbounded, int(skies_.size()), crown_.pairs()},
      values_(std::move(values)),
      sky_of_(light_count, -1) {
  for (size_t sky = 0; sky < skies_.size(); ++sky) sky_of_[size_t(skies_[sky].first)] = int(sky);
}

float LearnedLights::learned_pdf(int sky, const float* values, const V3f& wi) const {
  int cell = 0;
  const float in_cell = skies_[size_t(sky)].second.pdf(wi, &cell);
  const float* cdf = values + 1;
  return (cdf[cell] - (cell > 0 ? cdf[cell - 1] : 0)) * in_cell;
}

uint32_t LearnedLights::sample_all(const Light& light, int index, const LightReceiver& to, std::span<const V2f> u, LightSample* out) const {
  const float* values = sky_values(index, to);
  if (!values) return light.sample_all(to, u, out);
  const int sky = sky_of_[size_t(index)];
  const SkyCells& cells = skies_[size_t(sky)].second;
  const float share = values[0], *cdf = values + 1;
  uint32_t drawn = 0;
  V2f rest[Light::most_at_once];
  size_t of_light[Light::most_at_once], n = 0;
  for (size_t i = 0; i < u.size(); ++i) {
    if (u[i].x >= share) {
      of_light[n] = i, rest[n++] = V2f(std::min((u[i].x - share) / (1 - share), one_minus_epsilon), u[i].y);
      continue;
    }
    const float x = u[i].x / share;
    const int cell = int(std::upper_bound(cdf, cdf + SkyCells::count - 1, x) - cdf);
    const float below = cell > 0 ? cdf[cell - 1] : 0, probability = cdf[cell] - below;
    if (!(probability > 0)) continue;
    float in_cell = 0;
    const V3f wi = cells.draw(cell, V2f(std::clamp((x - below) / probability, 0.0f, one_minus_epsilon), u[i].y), &in_cell);
    const float pdf = lerp(share, light.pdf(to, wi, V3f(0, 0, 0), V3f(0, 0, 0)), learned_pdf(sky, values, wi));
    out[i] = {.wi = wi, .distance = infinity, .radiance = light.environment_at(to.p, wi, 0), .pdf = pdf, .delta = false};
    drawn |= uint32_t(pdf > 0 && pdf < infinity && !out[i].radiance.is_black()) << i;
  }
  LightSample own[Light::most_at_once];
  const uint32_t found = n > 0 ? light.sample_all(to, {rest, n}, own) : 0;
  for (size_t i = 0; i < n; ++i) {
    if (!(found >> i & 1)) continue;
    out[of_light[i]] = own[i];
    out[of_light[i]].pdf = lerp(share, own[i].pdf, learned_pdf(sky, values, own[i].wi));
    drawn |= 1u << of_light[i];
  }
  return drawn;
}

float LearnedLights::pdf(const Light& light, int index, const LightReceiver& to, const V3f& wi, const V3f& p_light,
                         const V3f& n_light) const {
  const float own = light.pdf(to, wi, p_light, n_light);
  const float* values = sky_values(index, to);
  return values ? lerp(values[0], own, learned_pdf(sky_of_[size_t(index)], values, wi)) : own;
}

size_t LearnedLights::bytes() const {
  return regions_.bytes() + values_.capacity() * sizeof(float) + skies_.size() * size_t(SkyCells::count * SkyCells::pieces * SkyCells::pieces * 5);
}

}  // namespace dapple::shading
