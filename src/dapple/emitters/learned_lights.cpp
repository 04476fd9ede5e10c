// SPDX-License-Identifier: Apache-2.0
#include "dapple/emitters/learned_lights.h"

#include <algorithm>

namespace dapple::emitters {

LearnedLights::LearnedLights(RegionTree regions, LightTree::Crown crown, int unbounded,
                             std::vector<std::pair<int, SkyCells>> skies, std::vector<float> values, size_t light_count)
    : regions_(std::move(regions)),
      crown_(std::move(crown)),
      skies_(std::move(skies)),
      layout_{unbounded, int(skies_.size()), crown_.pairs()},
      values_(std::move(values)),
      sky_of_(light_count, -1) {
  for (size_t sky = 0; sky < skies_.size(); ++sky) sky_of_[size_t(skies_[sky].first)] = int(sky);
}

uint32_t LearnedLights::sample_all(const Light& light, int index, const LightReceiver& to, std::span<const V2f> u,
                                   LightSample* out) const {
  const float* cdf = cells_of(index, to);
  if (!cdf) return light.sample_all(to, u, out);
  const SkyCells& cells = skies_[size_t(sky_of_[size_t(index)])].second;
  uint32_t drawn = 0;
  for (size_t i = 0; i < u.size(); ++i) {
    const int cell = int(std::upper_bound(cdf, cdf + SkyCells::count - 1, u[i].x) - cdf);
    const float below = cell > 0 ? cdf[cell - 1] : 0, probability = cdf[cell] - below;
    float in_cell = 0;
    const V3f wi =
        cells.draw(cell, V2f(std::clamp((u[i].x - below) / probability, 0.0f, one_minus_epsilon), u[i].y), &in_cell);
    out[i] = {.wi = wi,
              .distance = infinity,
              .radiance = light.environment_at(to.p, wi, 0),
              .pdf = probability * in_cell,
              .delta = false};
    drawn |= uint32_t(out[i].pdf > 0 && !out[i].radiance.is_black()) << i;
  }
  return drawn;
}

float LearnedLights::pdf(const Light& light, int index, const LightReceiver& to, const V3f& wi, const V3f& p_light,
                         const V3f& n_light) const {
  const float* cdf = cells_of(index, to);
  if (!cdf) return light.pdf(to, wi, p_light, n_light);
  int cell = 0;
  const float in_cell = skies_[size_t(sky_of_[size_t(index)])].second.pdf(wi, &cell);
  return (cdf[cell] - (cell > 0 ? cdf[cell - 1] : 0)) * in_cell;
}

}  // namespace dapple::emitters
