// SPDX-License-Identifier: Apache-2.0
#include "dapple/shafts/lamp_light.h"

namespace dapple::shafts {

namespace lane = pattern::lane;

namespace {
constexpr int block = ScanPlanes::block;
constexpr float most_column = 1e30f;
// Sine of the angle to a lamp: nearer, what is seen hardly changes.
constexpr float least_lamp_sine = 1e-6f;
constexpr float least_sine_of_sum = 1e-9f;
constexpr float spent_depth = 25;  // nothing is seen behind so much
constexpr float most_distance = 1e30f;

}  // namespace

LampLight::LampLight(const ScanPlanes& planes, const Haze& haze) : planes_(planes), haze_(haze) {
  const RGB& t = haze.sigma_t;
  channels_ = t.r == t.g && t.g == t.b ? 1 : 3;
  const V3f way = planes.frame().n * planes.settings().lamp;
  at_lamp_ = haze.density.at(planes.settings().eye + way);
}

float LampLight::entry_of(const V3f& P) const {
  const V3f lamp = planes_.settings().eye + planes_.frame().n * planes_.settings().lamp;
  const float r = length(P - lamp);
  return r > 0 ? haze_.density.column(lamp, (P - lamp) * (1 / r), r) : 0;
}

void LampLight::find_states(const ViewRay& v, int first, int n, BlockStates* states) const {
  constexpr int half = BlockNodes::half;
  const float* const edges = planes_.block_edges() + first;
  const float* const sines = planes_.block_sines() + first;
  const float* const cosines = planes_.block_cosines() + first;
  const float* const least = planes_.least(v.plane) + first;
  const float* const most = planes_.most(v.plane) + first;
  const float nearest = v.nearest;
  // At angle psi the ray is D sin phi / sin(phi + psi) from the lamp.
  alignas(64) float of_sum[half + 1];
  for (int i = 0; i <= half; ++i) of_sum[i] = v.sine * cosines[i] + v.cosine * sines[i];
  for (int i = 0; i < half; ++i) {
    const float ends = lane::max(of_sum[i], of_sum[i + 1]), low = lane::min(of_sum[i], of_sum[i + 1]);
    const float high = lane::choose((edges[i] < v.peak) & (v.peak < edges[i + 1]), 1, ends);
    const float near = lane::clamp(-most[i], 0, most_distance), far = lane::clamp(-least[i], 0, most_distance);
    const int32_t some = -int32_t(i < n) & -int32_t(high * far >= nearest);
    states->open[i] = some;
    states->lit[i] = some & -int32_t(low > 0) & -int32_t(low * near >= nearest);
  }
}

void LampLight::cut_bins(const ViewRay& v, int number, LitBins* lit) const {
  const float* const edges = planes_.edges() + number * block;
  const float* const sines = planes_.sines() + number * block;
  const float* const cosines = planes_.cosines() + number * block;
  const float* const blocked = planes_.blocked(v.plane) + number * block;
  const float nearest = v.nearest;
  alignas(64) float of_sum[block + 1];
  for (int i = 0; i <= block; ++i) of_sum[i] = v.sine * cosines[i] + v.cosine * sines[i];
  for (int i = 0; i < block; ++i) {
    const float R = lane::clamp(-blocked[i], 0, most_distance);
    const float e0 = of_sum[i] * R - nearest, e1 = of_sum[i + 1] * R - nearest, growth = e1 - e0;
    const float t = lane::clamp(-e0 / (growth != 0 ? growth : 1.0f), 0, 1);
    const float cut = edges[i] + t * (edges[i + 1] - edges[i]);
    const float begin = growth > 0 ? cut : edges[i];
    const float end = growth > 0 ? edges[i + 1] : growth < 0 ? cut : e0 >= 0 ? edges[i + 1] : edges[i];
    lit->begin[i] = lane::clamp(begin, v.first, v.last), lit->end[i] = lane::clamp(end, v.first, v.last);
  }
}

void LampLight::find_nodes(const ViewRay& v, int first, BlockNodes* nodes) const {
  constexpr int n = BlockNodes::count;
  BlockNodes& o = *nodes;
  o.first = first;
  alignas(64) float sines[n], cosines[n], r[n], column[n], thinner[n];
  constexpr int half = BlockNodes::half;
  const float* const edges = planes_.block_edges() + first;
  o.set_places(edges, v.first, v.last);
  for (int i = 0; i < half; ++i) {
    const float s = planes_.block_sines()[first + i], c = planes_.block_cosines()[first + i];
    const bool before = edges[i] <= v.first, after = edges[i] >= v.last;
    sines[i] = lane::choose(before, v.first_turn.x, lane::choose(after, v.last_turn.x, s));
    cosines[i] = lane::choose(before, v.first_turn.y, lane::choose(after, v.last_turn.y, c));
  }
  sines[half] = sines[half - 1], cosines[half] = cosines[half - 1];
  alignas(64) float sum[half], other_sum[half];
  for (int i = 0; i < half; ++i) sum[i] = sines[i] + sines[i + 1], other_sum[i] = cosines[i] + cosines[i + 1];
  for (int i = 0; i < half; ++i) {
    const float scale = 1 / lane::sqrt(sum[i] * sum[i] + other_sum[i] * other_sum[i]);
    sines[half + i] = sum[i] * scale, cosines[half + i] = other_sum[i] * scale;
  }
  const float D = planes_.settings().lamp, nearest = v.nearest, g = haze_.phase.g;
  const bool beside = planes_.is_orthographic();
  const float scale = at_lamp_ * (1 - g * g) / (4 * pi * nearest);
  for (int i = 0; i < n; ++i) {
    const float per_sum = 1 / lane::max(v.sine * cosines[i] + v.cosine * sines[i], least_sine_of_sum);
    const float base = 1 + g * g - 2 * g * (v.cosine * cosines[i] - v.sine * sines[i]);
    const float s = beside ? v.foot - nearest * cosines[i] * per_sum : D * sines[i] * per_sum;
    r[i] = nearest * per_sum;
    column[i] = lane::max(s - v.begin, 0);
    thinner[i] = v.rate * s - v.ahead;  // slope . (X - lamp)
    o.weight[i] = scale / (base * lane::sqrt(base));
  }
  if (haze_.density.is_constant()) {
    for (int i = 0; i < n; ++i) thinner[i] = 0, o.way[i] = r[i];
  } else {
    for (int i = 0; i < n; ++i) {
      column[i] = column_of(v.density, v.rate, column[i]);
      o.way[i] = column_of(at_lamp_, thinner[i] / lane::max(r[i], 1e-20f), r[i]);
    }
  }
  const EntryLine* const lines = planes_.bounded() ? planes_.entry_line(v.plane) + first : nullptr;
  for (int c = 0; c < channels_; ++c) {
    const float sigma = haze_.sigma_t[c];
    for (int i = 0; i < n; ++i) o.exponent[c][i] = sigma * lane::min(column[i] + o.way[i], most_column) + thinner[i];
    o.find_light(c, sigma, lines, edges);
  }
  o.finish(channels_);
}

// As add_steep_bins(), to a lamp, by the midpoint rule. Places in bins are told as parts of them, [0, 1]; sines and
// cosines there are those of the parabola through the bin's edges and middle.
void LampLight::add_steep_bins(const ViewRay& v, int number, LightSums* sums) const {
  const int at = number * block;
  const float* const edges = planes_.edges() + at;
  const float* const blocked = planes_.blocked(v.plane) + at;
  const float* const entry = planes_.bounded() ? planes_.entry(v.plane) + at : nullptr;
  const RGB* const tint = planes_.tinted() ? planes_.tint(v.plane) + at : nullptr;
  const float* const sines = planes_.sines() + at;
  const float* const cosines = planes_.cosines() + at;
  const float* const middle_sines = sines + planes_.bins() + 1;
  const float* const middle_cosines = cosines + planes_.bins() + 1;
  const float D = planes_.settings().lamp, nearest = v.nearest, g = haze_.phase.g;
  const bool beside = planes_.is_orthographic();
  const auto between = [](float a, float middle, float b, float f) {
    return a + f * (b - a) + 4 * f * (1 - f) * (middle - 0.5f * (a + b));
  };
  alignas(64) float l[block], way[block], weight[block], thinner[block], s[block], r[block];
  for (int i = 0; i < block; ++i) {
    const auto sine = [&](float f) { return between(sines[i], middle_sines[i], sines[i + 1], f); };
    const auto cosine = [&](float f) { return between(cosines[i], middle_cosines[i], cosines[i + 1], f); };
    const auto sine_of_sum = [&](float f) { return lane::max(v.sine * cosine(f) + v.cosine * sine(f), 1e-9f); };
    const float width = edges[i + 1] - edges[i];
    const float f0 = lane::clamp((v.first - edges[i]) / width, 0, 1),
                f1 = lane::clamp((v.last - edges[i]) / width, 0, 1);
    const float h0 = -nearest / sine_of_sum(f0), h1 = -nearest / sine_of_sum(f1), growth = h1 - h0;
    const float t = lane::clamp((blocked[i] - h0) / (growth != 0 ? growth : 1.0f), 0, 1), cut = f0 + t * (f1 - f0);
    const bool lit = blocked[i] <= h0;
    const float begin = growth > 0 ? cut : f0, end = growth > 0 ? f1 : growth < 0 ? cut : lit ? f1 : f0;
    const float f = 0.5f * (begin + end), sum = sine_of_sum(f);
    s[i] = beside ? v.foot - nearest * cosine(f) / sum : D * sine(f) / sum;
    r[i] = nearest / sum;
    const float base = 1 + g * g - 2 * g * (v.cosine * cosine(f) - v.sine * sine(f));
    weight[i] = (end - begin) * width * (1 - g * g) / (4 * pi * base * lane::sqrt(base) * nearest);
  }
  if (haze_.density.is_constant()) {
    for (int i = 0; i < block; ++i) l[i] = lane::max(s[i] - v.begin, 0), thinner[i] = 0;
    for (int i = 0; i < block; ++i) way[i] = r[i] - (entry ? entry[i] : 0.0f);
  } else {
    for (int i = 0; i < block; ++i) {
      l[i] = column_of(v.density, v.rate, lane::max(s[i] - v.begin, 0));
      thinner[i] = v.rate * s[i] - v.ahead;  // slope . (X - lamp)
      way[i] = column_of(at_lamp_, thinner[i] / lane::max(r[i], 1e-20f), r[i]) - (entry ? entry[i] : 0.0f);
      weight[i] *= at_lamp_;
    }
  }
  if (entry)
    for (int i = 0; i < block; ++i) weight[i] = way[i] < 0 ? 0.0f : weight[i];
  const int channels = planes_.tinted() ? 3 : channels_;
  for (int c = 0; c < channels; ++c) {
    // One exponential for the density and for what it absorbs: either alone may leave the range of floats.
    alignas(64) float light[block];
    for (int i = 0; i < block; ++i) {
      const float depth = haze_.sigma_t[c] * lane::min(l[i] + way[i], most_column) + thinner[i];
      light[i] = lane::choose(weight[i] > 0, weight[i] * lane::exp(-depth), 0);
    }
    float sum = 0;
    for (int i = 0; i < block; ++i) sum += light[i] * (tint ? tint[i][c] : 1.0f);
    sums->add(c, channels, double(sum));
  }
}

void LampLight::set_distance(const V3f& off, ViewRay* view) const {
  ViewRay& v = *view;
  const float D = planes_.settings().lamp;
  const V3f& axis = planes_.frame().n;
  const V3f way = axis * D - off;
  v.ahead = dot(haze_.density.slope, way);
  if (planes_.is_orthographic()) {
    v.foot = dot(way, axis);
    v.nearest = std::max(length(way - axis * v.foot), least_lamp_sine * D);
    v.sine = 0, v.cosine = 1;
    return;
  }
  v.sine = std::max(v.sine, least_lamp_sine);
  v.foot = D * v.cosine, v.nearest = D * v.sine;
}

void LampLight::place(ViewRay* view) const {
  ViewRay& v = *view;
  const float D = planes_.settings().lamp, absorbs = haze_.density.is_constant() ? haze_.sigma_t.min() : 0;
  if (absorbs > 0) v.end = std::min(v.end, v.begin + spent_depth / absorbs);
  // Sine and cosine of the angle at the lamp at which a place of the ray is seen.
  const auto turn = [&](float s) {
    if (!(s < infinity)) return V2f(v.sine, -v.cosine);
    const V2f t = planes_.is_orthographic() ? V2f(v.nearest, v.foot - s) : V2f(s * v.sine, D - s * v.cosine);
    return t * (1 / std::max(std::hypot(t.x, t.y), 1e-30f));
  };
  v.first_turn = turn(v.begin), v.last_turn = turn(v.end);
  v.first = std::atan2(v.first_turn.x, v.first_turn.y), v.last = std::atan2(v.last_turn.x, v.last_turn.y);
  v.peak = std::atan2(v.cosine, v.sine);
}

}  // namespace dapple::shafts
