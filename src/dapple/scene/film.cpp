// SPDX-License-Identifier: Apache-2.0
#include "dapple/scene/film.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "dapple/scene/filter.h"

namespace dapple::scene {

namespace {

// `v`, bounded such that any sum of samples is finite; 0 and a count more where it is not finite.
float kept(float v, uint32_t* dropped) {
  constexpr float most = 1e30f;
  if (std::isfinite(v)) return std::clamp(v, -most, most);
  ++*dropped;
  return 0;
}

// Four groups at a time, which compilers make vectors of.
RGB weighted_sum(const RGB* sums, std::span<const RGB> gains) {
  static_assert(sizeof(RGB) == 3 * sizeof(float));
  constexpr size_t lanes = 12;
  const float *const s = &sums->r, *const g = &gains.data()->r;
  const size_t n = 3 * gains.size(), whole = n / lanes * lanes;
  float all[lanes] = {};
  for (size_t i = 0; i < whole; i += lanes)
    for (size_t k = 0; k < lanes; ++k) all[k] += g[i + k] * s[i + k];
  for (size_t i = whole; i < n; ++i) all[i - whole] += g[i] * s[i];
  RGB sum;
  for (size_t k = 0; k < lanes; k += 3) sum += RGB(all[k], all[k + 1], all[k + 2]);
  return sum;
}
}  // namespace

Film::Film(const Settings& settings) : settings_(settings) {
  const size_t count = size_t(width()) * size_t(height());
  pixels_.resize(count);
  if (settings.features) features_.resize(count);
  group_sums_.resize(count * size_t(settings.light_groups));
  if (settings.cache_use) cache_features_.resize(count);
  if (settings.air) air_.resize(count);
  if (settings.direct) direct_.resize(count);
  if (settings.halves) halves_.resize(count);
  if (settings.signed_weights) squared_weights_.resize(count);
}

void Film::add(int x, int y, float weight, const RGB& radiance, const Features& f, std::span<const RGB> groups,
               const RGB& direct) {
  const size_t i = index(x, y);
  Pixel& p = pixels_[i];
  ++p.samples;
  weight = joining_weight(weight, p.weight);
  RGB L = radiance;
  float scale = settings_.scale;
  if (!L.is_finite() || L.min() < 0) {
    ++std::atomic_ref(dropped_samples_);
    L = RGB();
    groups = {};
    scale = 0;
  }
  if (settings_.white_balance) L = (*settings_.white_balance)(L);
  L *= scale;
  if (L.max() > settings_.max_component) {
    const float down = settings_.max_component / L.max();
    L *= down, scale *= down;
  }
  const double n = p.samples;
  for (int c = 0; c < 3; ++c) {
    const double v = double(weight) * double(L[c]);
    if (squared_weights_.empty() && p.samples > 1) {
      const double from_mean = v - p.sum[c] / (n - 1);
      p.deviations[c] += float(from_mean * from_mean * (n - 1) / n);
    }
    p.sum[c] += v;
  }
  RGB* const sums = group_sums_.data() + i * size_t(settings_.light_groups);
  for (size_t g = 0; g < groups.size(); ++g) sums[g] += groups[g] * (weight * scale);
  if (!direct_.empty() && scale > 0) direct_[i] += direct * (weight * scale);
  if (!halves_.empty() && (p.samples - 1) / halved_by % 2 == 0) {
    HalfSums& half = halves_[i];
    for (int c = 0; c < 3; ++c) half.sum[c] += double(weight) * double(L[c]);
    if (scale > 0) half.direct += direct * (weight * scale);
    half.weight += double(weight);
  }
  if (!squared_weights_.empty()) {
    SquaredWeights& sums_of_squares = squared_weights_[i];
    const double square = double(weight) * double(weight);
    for (int c = 0; c < 3; ++c) {
      sums_of_squares.squares[c] += square * double(L[c]) * double(L[c]);
      sums_of_squares.light[c] += square * double(L[c]);
    }
    sums_of_squares.alone += square;
  }
  p.weight += double(weight);
  if (features_.empty()) return;
  FeatureSums& s = features_[i];
  if (p.samples == 1) {
    s.grid = f.grid;
    s.grid.level = kept(f.grid.level, &s.dropped), s.grid.shading_rate = kept(f.grid.shading_rate, &s.dropped);
  }
  s.weight += weight;
  const float w = weight * kept(f.alpha, &s.dropped);
  s.hits += w;
  for (int c = 0; c < 3; ++c) {
    s.position[c] += w * kept(f.position[c], &s.dropped);
  }
  s.depth += w * kept(f.depth, &s.dropped);
}

void Film::add_air(int x, int y, float weight, const AirFeatures& air) {
  if (air_.empty() || !air.airlight.is_finite() || !air.transmittance.is_finite()) return;
  const RGB L = (settings_.white_balance ? (*settings_.white_balance)(air.airlight) : air.airlight) * settings_.scale;
  AirSums& s = air_[index(x, y)];
  weight = joining_weight(weight, s.weight);
  for (int c = 0; c < 3; ++c) {
    s.airlight[c] += double(weight) * double(L[c]);
    s.transmittance[c] += double(weight) * double(air.transmittance[c]);
  }
  s.weight += double(weight);
}

AirFeatures Film::air(int x, int y) const {
  AirFeatures air;
  if (air_.empty()) return air;
  const AirSums& s = air_[index(x, y)];
  if (s.weight == 0) return air;
  for (int c = 0; c < 3; ++c) {
    air.airlight[c] = float(s.airlight[c] / s.weight);
    air.transmittance[c] = float(s.transmittance[c] / s.weight);
  }
  return air;
}

void Film::set_gains(std::vector<RGB> gains) {
  if (std::all_of(gains.begin(), gains.end(), [](const RGB& gain) { return gain == RGB(1); })) gains.clear();
  if (!gains.empty() && gains.size() != size_t(settings_.light_groups))
    throw std::logic_error("the film does not keep the groups of these gains");
  gains_ = std::move(gains);
}

RGB Film::pixel(int x, int y) const {
  const Pixel& p = pixels_[index(x, y)];
  if (gains_.empty()) return sampled(p);
  if (p.weight == 0) return RGB();
  return mean_of(weighted_sum(&group_sums_[index(x, y) * gains_.size()], gains_), p.weight);
}

RGB Film::sampled(const Pixel& p) const {
  if (p.weight == 0) return RGB();
  const double inv = 1 / p.weight;
  return {float(p.sum[0] * inv), float(p.sum[1] * inv), float(p.sum[2] * inv)};
}

RGB Film::variance(int x, int y) const {
  const Pixel& p = pixels_[index(x, y)];
  RGB v;
  if (p.samples < 2 || p.weight == 0) return v;
  const double n = p.samples;
  for (int c = 0; c < 3; ++c) {
    double deviations = double(p.deviations[c]);
    if (!squared_weights_.empty()) {  // from the pixel: weights of both signs vary where light does not
      const SquaredWeights& w = squared_weights_[index(x, y)];
      const double mean = p.sum[c] / p.weight;
      deviations = std::max(0.0, w.squares[c] + mean * (mean * w.alone - 2 * w.light[c]));
    }
    v[c] = float(deviations * n / (n - 1) / (p.weight * p.weight));
  }
  return v;
}

uint32_t Film::samples(int x, int y) const {
  return pixels_[index(x, y)].samples;
}

Features Film::features(int x, int y) const {
  Features f;
  if (features_.empty()) return f;
  const FeatureSums& s = features_[index(x, y)];
  f.grid = s.grid;
  if (s.weight != 0) f.alpha = s.hits / s.weight;
  if (s.hits == 0) return f;
  const float inv = 1 / s.hits;
  for (int c = 0; c < 3; ++c) {
    f.position[c] = s.position[c] * inv;
  }
  f.depth = s.depth * inv;
  return f;
}

RGB Film::mean_of(const RGB& sum, double weight) const {
  const RGB mean(float(double(sum.r) / weight), float(double(sum.g) / weight), float(double(sum.b) / weight));
  return settings_.white_balance ? (*settings_.white_balance)(mean) : mean;
}

RGB Film::light_group(int x, int y, int group) const {
  const double weight = pixels_[index(x, y)].weight;
  if (weight == 0) return RGB();
  RGB sum = group_sums_[index(x, y) * size_t(settings_.light_groups) + size_t(group)];
  if (!gains_.empty()) sum *= gains_[size_t(group)];
  return mean_of(sum, weight);
}

RGB Film::direct(int x, int y) const {
  const double weight = pixels_[index(x, y)].weight;
  return weight == 0 ? RGB() : mean_of(direct_[index(x, y)], weight);
}

double Film::half_share(int x, int y, int which) const {
  const uint32_t n = pixels_[index(x, y)].samples,
                 first = n / (2 * halved_by) * halved_by + std::min(n % (2 * halved_by), halved_by);
  return n == 0 ? 0 : double(which == 0 ? first : n - first) / n;
}

RGB Film::half(int x, int y, int which) const {
  const Pixel& p = pixels_[index(x, y)];
  const HalfSums& first = halves_[index(x, y)];
  const double weight = half_share(x, y, which) * p.weight;
  if (weight == 0) return RGB();
  const double own = which == 0 ? first.weight : p.weight - first.weight;
  RGB mean;
  for (int c = 0; c < 3; ++c) {
    const double whole = p.sum[c] / p.weight, sum = which == 0 ? first.sum[c] : p.sum[c] - first.sum[c];
    mean[c] = float(whole + (sum - whole * own) / weight);
  }
  return mean;
}

RGB Film::half_direct(int x, int y, int which) const {
  const Pixel& p = pixels_[index(x, y)];
  const HalfSums& first = halves_[index(x, y)];
  const RGB& all = direct_[index(x, y)];
  const double weight = half_share(x, y, which) * p.weight;
  if (weight == 0) return RGB();
  const double own = which == 0 ? first.weight : p.weight - first.weight;
  return mean_of((which == 0 ? first.direct : all - first.direct) + all * float((weight - own) / p.weight), weight);
}

Film::Noise Film::noise(const Box2i& pixels) const {
  Noise sum;
  double n = 0;
  for (int y = pixels.min.y; y < pixels.max.y; ++y)
    for (int x = pixels.min.x; x < pixels.max.x; ++x, ++n) {
      const RGB v = variance(x, y);
      sum.variance += samples(x, y) < 2 ? double(infinity) : (double(v.r) + v.g + v.b) / 3;
      sum.mean += sampled(pixels_[index(x, y)]).average();
    }
  return {sum.variance / n, sum.mean / n};
}

double Film::relative_error() const {
  const Noise all = noise(settings_.crop);
  return all.variance > 0 ? std::sqrt(all.variance) / all.mean : 0;
}

uint64_t Film::dropped_features() const {
  uint64_t n = 0;
  for (const FeatureSums& s : features_) n += s.dropped;
  return n;
}

double Film::mean_samples() const {
  uint64_t n = 0;
  for (const Pixel& p : pixels_) n += p.samples;
  return double(n) / double(pixels_.size());
}

size_t Film::bytes() const {
  return pixels_.size() * sizeof(Pixel) + features_.size() * sizeof(FeatureSums) + group_sums_.size() * sizeof(RGB) +
         cache_features_.size() * sizeof(CacheFeatures) + air_.size() * sizeof(AirSums) + direct_.size() * sizeof(RGB) +
         halves_.size() * sizeof(HalfSums) + squared_weights_.size() * sizeof(SquaredWeights);
}

}  // namespace dapple::scene
