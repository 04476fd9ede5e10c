// SPDX-License-Identifier: Apache-2.0
#include "dapple/media/cloud_density.h"

#include <algorithm>

#include "dapple/pattern/noise.h"

namespace dapple::media {

namespace {

float noise_at(const V3f& p) {
  return pattern::lane::gradient_noise(p.x, p.y, p.z);
}

/// The gradient, by differences of this step (pbrt's).
V3f slope(const V3f& p) {
  constexpr float step = 0.01f;
  const float here = noise_at(p);
  return V3f(noise_at(p + V3f(step, 0, 0)) - here, noise_at(p + V3f(0, step, 0)) - here,
             noise_at(p + V3f(0, 0, step)) - here) *
         (1 / step);
}

constexpr float next_scale = 1.99f;

}  // namespace

float cloud_density(const V3f& p, float density, float wispiness, float frequency) {
  V3f at = p * frequency;
  if (wispiness > 0) {
    float weight = 0.05f * wispiness, scale = 10;
    for (int i = 0; i < 2; ++i) {
      at += slope(at * scale) * weight;
      weight *= 0.5f;
      scale *= next_scale;
    }
  }
  float sum = 0, weight = 0.5f, scale = 1;
  for (int i = 0; i < 5; ++i) {
    sum += weight * noise_at(at * scale);
    weight *= 0.5f;
    scale *= next_scale;
  }
  const float noisy = std::clamp((1 - p.y) * 4.5f * density * sum, 0.0f, 1.0f);
  const float value = noisy + 2 * std::max(0.0f, 0.5f - p.y);
  return value >= 0 ? std::min(value, 1.0f) : 0;
}

}  // namespace dapple::media
