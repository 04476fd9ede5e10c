// SPDX-License-Identifier: Apache-2.0
#include "dapple/shafts/air_light.h"

#include "dapple/pattern/lane_math.h"

namespace dapple::shafts {

namespace lane = pattern::lane;
using media::ExponentialDensity;

namespace {

constexpr int block = ScanPlanes::block;
// The sine of the sun's elevation over the scale height counts as at least this part of 1 over the scale height.
constexpr float least_rise = 1e-4f;
constexpr float most_column = 1e30f;
// Sine of the angle to a lamp: nearer, what is seen hardly changes.
constexpr float least_lamp_sine = 1e-6f;

// m(y) for y >= 0.
DAPPLE_LANE float mean_decay_of(float y) {
  const float series = 1 - y * (1 / 2.0f - y * (1 / 6.0f - y * (1 / 24.0f - y * (1 / 120.0f - y * (1 / 720.0f)))));
  const float direct = (1 - lane::exp(-y)) / (y > 0.3f ? y : 1.0f);
  return lane::choose(y > 0.3f, direct, series);
}

// Of density x and rate r over a length t.
DAPPLE_LANE float column_of(float density, float rate, float t) {
  const float y = rate * t, size = lane::abs(y);
  const float mean = mean_decay_of(size);
  return density * t * mean * (y < 0 ? lane::exp(size) : 1.0f);
}

}  // namespace

/// A view ray in its plane.
struct AirLight::View {
  int plane = 0;
  float cosine = 1, sine = 0;  // of the angle between the ray and the axis
  float begin = 0, end = 0;
  float density = 1, rate = 0;  // where it begins, and along it
  float k = 0, ahead = 0;       // depths: sigma_t (k l + ahead - entry)
};

struct AirLight::Sums {
  double of[3] = {0, 0, 0};  // by channel, over sigma_s

  // What channel c gets, or, of one, all.
  void add(int c, int channels, double light) {
    for (int i = c; i < (channels == 1 ? 3 : c + 1); ++i) of[i] += light;
  }
};

AirLight::AirLight(const ScanPlanes& planes, const Haze& haze) : planes_(planes), haze_(haze) {
  const V3f& slope = haze_.density.slope;
  rise_ = dot(slope, planes.frame().n);
  const float least = least_rise * length(slope);
  if (std::abs(rise_) < least) rise_ = std::copysign(least, rise_);
  const RGB& t = haze_.sigma_t;
  channels_ = t.r == t.g && t.g == t.b ? 1 : 3;
  unbounded_ = !planes.bounded();
}

float AirLight::entry_of(const V3f& P) const {
  if (planes_.is_lamp()) return length(P - (planes_.settings().eye + planes_.frame().n * planes_.settings().lamp));
  if (haze_.density.is_constant()) return -dot(P - planes_.settings().eye, planes_.frame().n);
  return haze_.density.at(P) / rise_;
}

AirLight::View AirLight::view_of(const Segment& s) const {
  View v;
  v.plane = planes_.plane_of(s.d, s.xi);
  v.cosine = std::clamp(dot(s.d, planes_.frame().n), -1.0f, 1.0f);
  v.sine = length(cross(s.d, planes_.frame().n));
  v.begin = s.begin, v.end = s.end;
  v.density = haze_.density.at(planes_.settings().eye + s.d * s.begin);
  v.rate = dot(haze_.density.slope, s.d);
  if (haze_.density.is_constant()) {
    // 1 - cos, which would lose its digits near the sun.
    v.k = v.cosine > 0 ? v.sine * v.sine / (1 + v.cosine) : 1 - v.cosine;
    v.ahead = -s.begin * v.cosine;
  } else {
    v.k = 1 - v.rate / rise_;
    v.ahead = v.density / rise_;
  }
  return v;
}

RGB AirLight::in_scattering(const Segment& s) const {
  if (!(s.end > s.begin) || haze_.sigma_s.is_black()) return {};
  return planes_.is_lamp() ? from_lamp(s) : parallel(s);
}

// All of [begin, end], which is lit.
void AirLight::add_run(const View& v, float begin, float end, Sums* sums) const {
  const auto column = [&](float s) {
    return haze_.density.is_constant() ? s - v.begin : ExponentialDensity::column(v.density, v.rate, s - v.begin);
  };
  const float a = column(begin), b = column(end);
  if (!(b > a)) return;
  for (int c = 0; c < channels_; ++c) {
    const float sigma = haze_.sigma_t[c], rate = sigma * v.k;
    // From the end where more is left.
    const float depth = sigma * v.ahead + rate * (v.k >= 0 ? a : b), y = std::abs(rate) * (b - a);
    if (!(depth < 200)) continue;
    const float part = y < 1e30f ? (b - a) * media::mean_decay(y) : 1 / std::abs(rate);
    sums->add(c, channels_, double(std::exp(-depth)) * double(part));
  }
}

// The bins of a block, each cut where its shadow begins.
void AirLight::add_bins(const View& v, int number, Sums* sums) const {
  const float* const edges = planes_.edges() + number * block;
  const float* const blocked = planes_.blocked(v.plane) + number * block;
  const float* const entry = planes_.bounded() ? planes_.entry(v.plane) + number * block : nullptr;
  const RGB* const tint = planes_.tinted() ? planes_.tint(v.plane) + number * block : nullptr;
  const float per_u = 1 / std::max(v.sine, 1e-9f);
  alignas(64) float s[block + 1], a[block], b[block];
  for (int i = 0; i <= block; ++i) s[i] = lane::clamp(edges[i] * per_u, v.begin, v.end);
  for (int i = 0; i < block; ++i) {
    const float h = s[i] * v.cosine, growth = (s[i + 1] - s[i]) * v.cosine;
    const float t = lane::clamp((blocked[i] - h) / (growth != 0 ? growth : 1.0f), 0, 1),
                cut = s[i] + t * (s[i + 1] - s[i]);
    const bool lit = blocked[i] <= h;
    a[i] = growth > 0 ? cut : s[i];
    b[i] = growth > 0 ? s[i + 1] : growth < 0 ? cut : lit ? s[i + 1] : s[i];
  }
  if (haze_.density.is_constant()) {
    for (int i = 0; i < block; ++i) a[i] -= v.begin, b[i] -= v.begin;
  } else {
    for (int i = 0; i < block; ++i) {
      a[i] = column_of(v.density, v.rate, a[i] - v.begin);
      b[i] = column_of(v.density, v.rate, b[i] - v.begin);
    }
  }
  for (int c = 0; c < channels_; ++c) {
    const float sigma = haze_.sigma_t[c], rate = sigma * v.k, size = lane::abs(rate);
    const bool falls = v.k >= 0;
    alignas(64) float light[block], way[block];
    for (int i = 0; i < block; ++i) way[i] = v.ahead;
    if (entry)
      for (int i = 0; i < block; ++i) way[i] -= entry[i];  // no light enters: the way is -infinity
    for (int i = 0; i < block; ++i) {
      const float length = b[i] - a[i];
      const float depth = sigma * way[i] + rate * (falls ? a[i] : b[i]);
      const float part = lane::exp(-depth) * length * mean_decay_of(size * length);
      light[i] = lane::choose(length > 0 && way[i] > -1e30f, part, 0);
    }
    if (tint) {
      // Colour may differ where extinction does not.
      for (int channel = c; channel < (channels_ == 1 ? 3 : c + 1); ++channel) {
        float sum = 0;
        for (int i = 0; i < block; ++i) sum += light[i] * tint[i][channel];
        sums->of[channel] += double(sum);
      }
    } else {
      float sum = 0;
      for (int i = 0; i < block; ++i) sum += light[i];
      sums->add(c, channels_, double(sum));
    }
  }
}

RGB AirLight::parallel(const Segment& segment) const {
  if (unbounded_ && (haze_.density.is_constant() ? haze_.sigma_t.max() > 0 : rise_ < 0)) return {};
  const View v = view_of(segment);
  Sums sums;
  const float u0 = v.begin * v.sine, u1 = v.end * v.sine, last_edge = planes_.edge(planes_.bins());
  const bool uniform = unbounded_ && !planes_.tinted();
  const float per_u = 1 / std::max(v.sine, 1e-9f);
  const float* const least = planes_.least(v.plane);
  const float* const most = planes_.most(v.plane);
  float run = -1;  // where the run of light that goes on began
  const auto at_edge = [&](int b) { return lane::clamp(planes_.edge(b * block) * per_u, v.begin, v.end); };
  if (u0 < last_edge) {
    const int all = planes_.blocks();
    int first = std::min(planes_.bin_of(u0) / block, all - 1), last = std::min(planes_.bin_of(u1) / block, all - 1);
    while (first > 0 && planes_.edge(first * block) > u0) --first;
    while (last + 1 < all && planes_.edge((last + 1) * block) < u1) ++last;
    float here = at_edge(first);
    for (int b = first; b <= last; ++b) {
      const float next = at_edge(b + 1), h0 = here * v.cosine, h1 = next * v.cosine;
      const bool dark = lane::max(h0, h1) < least[b], lit = lane::min(h0, h1) >= most[b];
      if (uniform && lit) {
        if (run < 0) run = here;
      } else {
        if (run >= 0) add_run(v, run, here, &sums), run = -1;
        if (!dark) add_bins(v, b, &sums);
      }
      here = next;
    }
  }
  // Beyond the bins nothing stands in the way.
  if (planes_.settings().open && u1 > last_edge) {
    const float begin = std::clamp(last_edge * per_u, v.begin, v.end);
    add_run(v, run >= 0 ? run : begin, v.end, &sums);
  } else if (run >= 0) {
    add_run(v, run, v.end, &sums);
  }
  const float phase = haze_.phase.eval(-segment.d, planes_.frame().n);
  RGB out;
  for (int c = 0; c < 3; ++c) out[c] = haze_.sigma_s[c] * phase * float(sums.of[c]);
  return out;
}

// As add_bins(), to a lamp, between angles first and last. Places in bins are told as parts of them, [0, 1]; sines and
// cosines there are those of the parabola through the bin's edges and middle.
void AirLight::add_lamp_bins(const View& v, int number, float first, float last, Sums* sums) const {
  const int at = number * block;
  const float* const edges = planes_.edges() + at;
  const float* const blocked = planes_.blocked(v.plane) + at;
  const float* const entry = planes_.bounded() ? planes_.entry(v.plane) + at : nullptr;
  const RGB* const tint = planes_.tinted() ? planes_.tint(v.plane) + at : nullptr;
  const float* const sines = planes_.sines() + at;
  const float* const cosines = planes_.cosines() + at;
  const float* const middle_sines = sines + planes_.bins() + 1;
  const float* const middle_cosines = cosines + planes_.bins() + 1;
  const float D = planes_.settings().lamp, g = haze_.phase.g;
  const auto between = [](float a, float middle, float b, float f) {
    return a + f * (b - a) + 4 * f * (1 - f) * (middle - 0.5f * (a + b));
  };
  alignas(64) float l[block], way[block], weight[block], thinner[block], s[block], r[block];
  for (int i = 0; i < block; ++i) {
    const auto sine = [&](float f) { return between(sines[i], middle_sines[i], sines[i + 1], f); };
    const auto cosine = [&](float f) { return between(cosines[i], middle_cosines[i], cosines[i + 1], f); };
    const auto sine_of_sum = [&](float f) { return lane::max(v.sine * cosine(f) + v.cosine * sine(f), 1e-9f); };
    const float width = edges[i + 1] - edges[i];
    const float f0 = lane::clamp((first - edges[i]) / width, 0, 1), f1 = lane::clamp((last - edges[i]) / width, 0, 1);
    const float h0 = -D * v.sine / sine_of_sum(f0), h1 = -D * v.sine / sine_of_sum(f1), growth = h1 - h0;
    const float t = lane::clamp((blocked[i] - h0) / (growth != 0 ? growth : 1.0f), 0, 1), cut = f0 + t * (f1 - f0);
    const bool lit = blocked[i] <= h0;
    const float begin = growth > 0 ? cut : f0, end = growth > 0 ? f1 : growth < 0 ? cut : lit ? f1 : f0;
    const float f = 0.5f * (begin + end), sum = sine_of_sum(f);
    s[i] = D * sine(f) / sum, r[i] = D * v.sine / sum;
    const float base = 1 + g * g - 2 * g * (v.cosine * cosine(f) - v.sine * sine(f));
    weight[i] = (end - begin) * width * (1 - g * g) / (4 * pi * base * lane::sqrt(base) * D * v.sine);
  }
  if (haze_.density.is_constant()) {
    for (int i = 0; i < block; ++i) l[i] = lane::max(s[i] - v.begin, 0), thinner[i] = 0;
    for (int i = 0; i < block; ++i) way[i] = lane::max(r[i] - (entry ? entry[i] : 0.0f), 0);
  } else {
    const V3f& n = planes_.frame().n;
    const float at_lamp = haze_.density.at(planes_.settings().eye + n * D), to_lamp = dot(haze_.density.slope, n) * D;
    for (int i = 0; i < block; ++i) {
      l[i] = column_of(v.density, v.rate, lane::max(s[i] - v.begin, 0));
      thinner[i] = v.rate * s[i] - to_lamp;  // slope . (X - lamp), X = s d
      const float rate = thinner[i] / lane::max(r[i], 1e-20f), from = entry ? lane::min(entry[i], r[i]) : 0.0f;
      way[i] = lane::max(column_of(at_lamp, rate, r[i]) - column_of(at_lamp, rate, from), 0);
      weight[i] *= at_lamp;
    }
  }
  if (entry)
    for (int i = 0; i < block; ++i) weight[i] = entry[i] > r[i] ? 0.0f : weight[i];
  for (int c = 0; c < (tint ? 3 : channels_); ++c) {
    // One exponential for the density and for what it absorbs: either alone may leave the range of floats.
    alignas(64) float light[block];
    for (int i = 0; i < block; ++i) {
      const float depth = haze_.sigma_t[c] * lane::min(l[i] + way[i], most_column) + thinner[i];
      light[i] = lane::choose(weight[i] > 0, weight[i] * lane::exp(-depth), 0);
    }
    float sum = 0;
    for (int i = 0; i < block; ++i) sum += light[i] * (tint ? tint[i][c] : 1.0f);
    sums->add(c, tint ? 3 : channels_, double(sum));
  }
}

RGB AirLight::from_lamp(const Segment& segment) const {
  View v = view_of(segment);
  v.sine = std::max(v.sine, least_lamp_sine);
  const float D = planes_.settings().lamp, phi = std::atan2(v.sine, v.cosine);
  const auto angle = [&](float s) { return s < infinity ? std::atan2(s * v.sine, D - s * v.cosine) : pi - phi; };
  const float first_u = angle(v.begin), last_u = std::min(angle(v.end), pi - phi);
  const int all = planes_.blocks();
  int first = std::min(planes_.bin_of(first_u) / block, all - 1),
      last = std::min(planes_.bin_of(last_u) / block, all - 1);
  while (first > 0 && planes_.edge(first * block) > first_u) --first;
  while (last + 1 < all && planes_.edge((last + 1) * block) < last_u) ++last;
  Sums sums;
  const float* const least = planes_.least(v.plane);
  // The highest point of the ray is where it passes nearest to the lamp.
  const auto height = [&](float u) { return -D * v.sine / std::max(std::sin(phi + u), 1e-9f); };
  const float highest = std::clamp(0.5f * pi - phi, first_u, last_u);
  for (int b = first; b <= last; ++b) {
    const float u = std::clamp(highest, planes_.edge(b * block), planes_.edge((b + 1) * block));
    if (height(std::clamp(u, first_u, last_u)) >= least[b]) add_lamp_bins(v, b, first_u, last_u, &sums);
  }
  RGB out;
  for (int c = 0; c < 3; ++c) out[c] = haze_.sigma_s[c] * float(sums.of[c]);
  return out;
}

}  // namespace dapple::shafts
