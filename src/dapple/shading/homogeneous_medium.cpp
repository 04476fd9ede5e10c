// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/homogeneous_medium.h"

#include "dapple/base/hash.h"

namespace dapple::shading {

HomogeneousMedium::HomogeneousMedium(RGB sigma_a, RGB sigma_s, RGB emission, HenyeyGreenstein phase)
    : Medium(phase), sigma_s_(sigma_s), sigma_t_(sigma_a + sigma_s) {
  for (int c = 0; c < 3; ++c) source_[c] = sigma_a[c] > 0 ? emission[c] * (sigma_a[c] / sigma_t_[c]) : 0;
}

RGB HomogeneousMedium::transmittance(float t) const {
  RGB out;
  for (int c = 0; c < 3; ++c) out[c] = sigma_t_[c] > 0 ? std::exp(-sigma_t_[c] * t) : 1;  // also for infinite t
  return out;
}

RGB HomogeneousMedium::transmittance(const Ray&, float t_max, uint64_t) const {
  return transmittance(t_max);
}

MediumSample HomogeneousMedium::sample(const Ray&, float t_max, const RGB& beta, uint64_t key) const {
  MediumSample out;
  if (!source_.is_black()) out.emitted = source_ * (RGB(1) - transmittance(t_max));
  if (sigma_s_.is_black()) {  // nothing to draw
    out.t = t_max;
    out.weight = transmittance(t_max);
    return out;
  }
  const float sum = beta.r + beta.g + beta.b;
  const RGB choice = sum > 1e-30f && std::isfinite(sum) ? beta * (1 / sum) : RGB(1.0f / 3);

  KeyedRng rng(key);
  const float u = rng.next();
  const float sigma = u < choice.r ? sigma_t_.r : u < choice.r + choice.g ? sigma_t_.g : sigma_t_.b;
  const float t = sigma > 0 ? -std::log1p(-rng.next()) / sigma : infinity;
  out.scattered = t < t_max;
  out.t = out.scattered ? t : t_max;
  const RGB through = transmittance(out.t);
  const RGB density = out.scattered ? choice * sigma_t_ * through : choice * through;
  const float pdf = density.r + density.g + density.b;
  if (!(pdf > 0)) {
    out.weight = RGB(0);  // drawn with a probability that rounds to zero
    return out;
  }
  out.weight = out.scattered ? sigma_s_ * through * (1 / pdf) : through * (1 / pdf);
  if (!out.weight.is_finite()) out.weight = RGB(0);
  return out;
}

}  // namespace dapple::shading
