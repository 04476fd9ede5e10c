// SPDX-License-Identifier: Apache-2.0
#include "dapple/media/closed_form_medium.h"

#include "dapple/base/hash.h"

namespace dapple::media {

namespace {
// Probabilities of the channels of which one chooses the distance.
RGB choice_of(const RGB& beta) {
  const float sum = beta.r + beta.g + beta.b;
  return sum > 1e-30f && std::isfinite(sum) ? beta * (1 / sum) : RGB(1.0f / 3);
}

float chosen(const RGB& choice, const RGB& values, float u) {
  return u < choice.r ? values.r : u < choice.r + choice.g ? values.g : values.b;
}
}  // namespace

ClosedFormMedium::ClosedFormMedium(RGB sigma_a, RGB sigma_s, RGB emission, HenyeyGreenstein phase,
                                   const ExponentialDensity& density)
    : Medium(phase), sigma_s_(sigma_s), sigma_t_(sigma_a + sigma_s), density_(density) {
  for (int c = 0; c < 3; ++c) source_[c] = sigma_a[c] > 0 ? emission[c] * (sigma_a[c] / sigma_t_[c]) : 0;
}

RGB ClosedFormMedium::through(float column) const {
  RGB out;
  for (int c = 0; c < 3; ++c)
    out[c] = sigma_t_[c] > 0 ? std::exp(-sigma_t_[c] * column) : 1;  // also for infinite columns
  return out;
}

RGB ClosedFormMedium::transmittance(const Ray& ray, float t_max, uint64_t) const {
  return through(density_.column(ray.o, ray.d, t_max));
}

MediumSample ClosedFormMedium::sample(const Ray& ray, float t_max, const RGB& beta, uint64_t key) const {
  MediumSample out;
  const float all = density_.column(ray.o, ray.d, t_max);
  if (!source_.is_black()) out.emitted = source_ * (RGB(1) - through(all));
  if (sigma_s_.is_black()) {  // nothing to draw
    out.t = t_max;
    out.weight = through(all);
    return out;
  }
  const RGB choice = choice_of(beta);
  KeyedRng rng(key);
  const float sigma = chosen(choice, sigma_t_, rng.next());
  const float column = sigma > 0 ? -std::log1p(-rng.next()) / sigma : infinity;
  out.scattered = column < all;
  out.t = out.scattered ? std::min(density_.distance(ray.o, ray.d, column), t_max) : t_max;
  const RGB left = through(out.scattered ? column : all);
  const RGB density = out.scattered ? choice * sigma_t_ * left : choice * left;
  const float pdf = density.r + density.g + density.b;
  if (!(pdf > 0)) {
    out.weight = RGB(0);  // drawn with a probability that rounds to zero
    return out;
  }
  out.weight = out.scattered ? sigma_s_ * left * (1 / pdf) : left * (1 / pdf);
  if (!out.weight.is_finite()) out.weight = RGB(0);
  return out;
}

MediumCrossing ClosedFormMedium::cross(const Ray& ray, float t_max, const RGB& beta, uint64_t key,
                                       bool scatters) const {
  MediumCrossing out{transmittance(ray, t_max, 0), emitted(ray, t_max), {}};
  if (scatters) out.scattering = sample_scattering(ray, t_max, beta, key);
  return out;
}

MediumSample ClosedFormMedium::sample_scattering(const Ray& ray, float t_max, const RGB& beta, uint64_t key) const {
  MediumSample out;
  out.t = t_max;
  out.weight = RGB();
  const float all = density_.column(ray.o, ray.d, t_max);
  RGB stopped;  // 1 - T of the whole way
  for (int c = 0; c < 3; ++c) stopped[c] = sigma_t_[c] > 0 ? -std::expm1(-sigma_t_[c] * all) : 0;
  if (sigma_s_.is_black() || stopped.is_black()) return out;
  // A channel that is not stopped at all cannot choose a distance.
  const RGB choice = choice_of(beta * stopped);
  KeyedRng rng(key);
  const float u = rng.next(), sigma = chosen(choice, sigma_t_, u), part = chosen(choice, stopped, u);
  if (!(sigma > 0)) return out;
  const float column = std::min(-std::log1p(-rng.next() * part) / sigma, all);
  RGB density, left = through(column);
  for (int c = 0; c < 3; ++c) density[c] = stopped[c] > 0 ? choice[c] * sigma_t_[c] * left[c] / stopped[c] : 0;
  const float pdf = density.r + density.g + density.b;
  if (!(pdf > 0)) return out;
  out.t = std::min(density_.distance(ray.o, ray.d, column), t_max);
  out.scattered = std::isfinite(out.t);
  out.weight = sigma_s_ * left * (1 / pdf);
  if (!out.weight.is_finite()) out.weight = RGB();
  return out;
}

}  // namespace dapple::media
