// SPDX-License-Identifier: Apache-2.0
#include "dapple/shafts/air_light.h"

namespace dapple::shafts {

namespace lane = pattern::lane;
using media::ExponentialDensity;

namespace {

constexpr int block = ScanPlanes::block;
// The sine of the sun's elevation over the scale height counts as at least this part of 1 over the scale height.
constexpr float least_rise = 1e-4f;
constexpr float least_sine = 1e-9f;
constexpr float spent_depth = 25;  // nothing is seen behind so much
constexpr float most_slant = 1e30f;

}  // namespace

AirLight::AirLight(const ScanPlanes& planes, const Haze& haze) : planes_(planes), haze_(haze) {
  const V3f& slope = haze_.density.slope;
  rise_ = dot(slope, planes.frame().n);
  const float least = least_rise * length(slope);
  if (std::abs(rise_) < least) rise_ = std::copysign(least, rise_);
  const RGB& t = haze_.sigma_t;
  channels_ = t.r == t.g && t.g == t.b ? 1 : 3;
  unbounded_ = !planes.bounded();
  if (planes.is_lamp()) lamp_.emplace(planes, haze);
}

float AirLight::entry_of(const V3f& P) const {
  if (lamp_) return lamp_->entry_of(P);
  if (haze_.density.is_constant()) return -dot(P - planes_.settings().eye, planes_.frame().n);
  return haze_.density.at(P) / rise_;
}

ViewRay AirLight::view_of(const Segment& s) const {
  ViewRay v;
  v.plane = planes_.is_sheaf() ? planes_.plane_beside(s.off, s.xi)
                               : planes_.plane_of(planes_.is_orthographic() ? s.off : s.d, s.xi);
  v.cosine = std::clamp(dot(s.d, planes_.frame().n), -1.0f, 1.0f);
  v.sine = std::max(length(cross(s.d, planes_.frame().n)), least_sine);
  v.begin = s.begin, v.end = s.end;
  if (planes_.is_sheaf()) {
    const float before = dot(s.off, planes_.across(v.plane)) / v.sine;
    v.begin += before, v.end += before;
    v.lift = dot(s.off, planes_.frame().n) - before * v.cosine;
  }
  if (lamp_) lamp_->set_distance(s.off, &v);
  v.density = haze_.density.at(planes_.settings().eye + s.off + s.d * s.begin);
  v.rate = dot(haze_.density.slope, s.d);
  if (lamp_) return v;
  if (haze_.density.is_constant()) {
    // 1 - cos, which would lose its digits near the sun.
    v.k = v.cosine > 0 ? v.sine * v.sine / (1 + v.cosine) : 1 - v.cosine;
    v.ahead = -v.begin * v.cosine - v.lift;
  } else {
    v.k = 1 - v.rate / rise_;
    v.ahead = v.density / rise_;
  }
  return v;
}

RGB AirLight::in_scattering(const Segment& s) const {
  if (!(s.end > s.begin) || haze_.sigma_s.is_black()) return {};
  return lamp_ ? from_lamp(s) : parallel(s);
}

// Of all blocks through which the ray goes.
void AirLight::scan(const ViewRay& v, LightSums* sums) const {
  const int all = planes_.blocks();
  int first = std::min(planes_.bin_of(v.first) / block, all - 1),
      last = std::min(planes_.bin_of(v.last) / block, all - 1);
  while (first > 0 && planes_.block_edges()[first] > v.first) --first;
  while (last + 1 < all && planes_.block_edges()[last + 1] < v.last) ++last;
  BlockNodes nodes;
  BlockStates states;
  const bool runs = !lamp_ && unbounded_ && !planes_.tinted();
  float run = -1;  // of parallel light, where groups of blocks that are lit as a whole begin
  const auto end_run = [&](int b) {
    if (run >= 0) add_run(v, run, place_of(v, b), sums);
    run = -1;
  };
  for (int begin = first; begin <= last; begin += BlockNodes::blocks) {
    const int n = std::min(BlockNodes::blocks, last + 1 - begin);
    lamp_ ? lamp_->find_states(v, begin, n, &states) : find_states(v, begin, n, &states);
    if (runs && states.all_lit(n)) {
      if (run < 0) run = place_of(v, begin);
      continue;
    }
    end_run(begin);
    if (!states.any()) continue;
    lamp_ ? lamp_->find_nodes(v, begin, &nodes) : find_nodes(v, begin, &nodes);
    add_whole(v, nodes, &states, sums);
    for (int i = 0; i < n; ++i)
      if (states.open[i]) add_block(v, nodes, begin + i, sums);
  }
  end_run(last + 1);
}

// Where the ray meets the rays of light that block b begins with.
float AirLight::place_of(const ViewRay& v, int b) const {
  return lane::clamp(planes_.block_edges()[b] / v.sine, v.begin, v.end);
}

// Blocks that are lit as a whole and smooth; these are closed in `states`.
void AirLight::add_whole(const ViewRay& v, const BlockNodes& nodes, BlockStates* states, LightSums* sums) const {
  constexpr int n = BlockNodes::half;
  constexpr uint8_t even = ScanPlanes::even_tint | ScanPlanes::even_entry;
  const uint8_t* const marks = planes_.marks(v.plane) + nodes.first;
  alignas(64) int32_t whole[n];
  for (int i = 0; i < n; ++i)
    whole[i] = states->lit[i] & -int32_t(nodes.bend[i] <= 0) & -int32_t((marks[i] & even) == even);
  const int channels = sums_wanted();
  const RGB* const tint = planes_.tinted() ? planes_.tint(v.plane) : nullptr;
  for (int c = 0; c < channels; ++c) {
    const float* const light = nodes.whole[channels_ == 1 ? 0 : c];
    float* const out = sums->bins.of[c];
    if (tint) {
      for (int i = 0; i < BlockNodes::blocks; ++i)
        if (whole[i]) out[i] += light[i] * tint[(nodes.first + i) * block][c];
    } else {
      for (int i = 0; i < n; ++i) out[i] += lane::choose(whole[i], light[i], 0);
    }
  }
  for (int i = 0; i < n; ++i) states->open[i] &= ~whole[i];
}

// What is lit of a block.
void AirLight::add_block(const ViewRay& v, const BlockNodes& nodes, int number, LightSums* sums) const {
  const int n = number - nodes.first, channels = sums_wanted();
  const uint8_t mark = planes_.marks(v.plane)[number];
  const bool enters = !(mark & ScanPlanes::even_entry);
  if (enters ? nodes.is_steep(n, channels_) : !(nodes.bend[n] <= 0))
    return lamp_ ? lamp_->add_steep_bins(v, number, sums) : add_steep_bins(v, number, sums);
  LitBins lit;
  lamp_ ? lamp_->cut_bins(v, number, &lit) : cut_bins(v, number, &lit);
  const RGB* const tint = planes_.tinted() ? planes_.tint(v.plane) + number * block : nullptr;
  for (int c = 0; c < channels_; ++c) {
    const int last = channels_ == 1 ? channels - 1 : c;
    if (enters)
      add_entering(nodes, n, lit, c, c, last, haze_.sigma_t[c], planes_.entry(v.plane) + number * block, tint,
                   planes_.is_lamp(), &sums->bins);
    else
      add_smooth(nodes, n, lit, c, c, last, tint, mark & ScanPlanes::even_tint, &sums->bins);
  }
}

// All of [begin, end], which is lit.
void AirLight::add_run(const ViewRay& v, float begin, float end, LightSums* sums) const {
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

void AirLight::find_nodes(const ViewRay& v, int first, BlockNodes* nodes) const {
  constexpr int n = BlockNodes::count;
  BlockNodes& o = *nodes;
  o.first = first;
  const float per_u = 1 / v.sine;
  o.set_places(planes_.block_edges() + first, v.first, v.last);
  alignas(64) float thinner[n], column[n];
  if (haze_.density.is_constant()) {
    for (int i = 0; i < n; ++i) thinner[i] = 0, column[i] = o.u[i] * per_u - v.begin;
  } else {
    for (int i = 0; i < n; ++i) {
      const float t = lane::max(o.u[i] * per_u - v.begin, 0), y = lane::clamp(v.rate * t, -80, 80);
      const float series = 1 - y * (1 / 2.0f - y * (1 / 6.0f - y * (1 / 24.0f - y * (1 / 120.0f - y * (1 / 720.0f)))));
      const float direct = (1 - lane::exp(-y)) / (lane::abs(y) > 0.3f ? y : 1.0f);
      const float mean = lane::choose(lane::abs(y) > 0.3f, direct, series);
      thinner[i] = y, column[i] = v.density * t * mean;
    }
  }
  for (int i = 0; i < n; ++i) o.weight[i] = v.density, o.way[i] = 0;
  const EntryLine* const lines = planes_.bounded() ? planes_.entry_line(v.plane) + first : nullptr;
  for (int c = 0; c < channels_; ++c) {
    const float sigma = haze_.sigma_t[c];
    for (int i = 0; i < n; ++i) o.exponent[c][i] = thinner[i] + sigma * (v.k * column[i] + v.ahead);
    o.find_light(c, sigma, lines, planes_.block_edges() + first);
  }
  o.finish(channels_);
}

void AirLight::find_states(const ViewRay& v, int first, int n, BlockStates* states) const {
  const float* const edges = planes_.block_edges() + first;
  const float* const least = planes_.least(v.plane) + first;
  const float* const most = planes_.most(v.plane) + first;
  const float per_u = 1 / v.sine;
  alignas(64) float height[BlockNodes::half + 1];
  for (int i = 0; i <= BlockNodes::half; ++i)
    height[i] = lane::clamp(edges[i] * per_u, v.begin, v.end) * v.cosine + v.lift;
  for (int i = 0; i < BlockNodes::half; ++i) {
    const int32_t some = -int32_t(i < n) & -int32_t(lane::max(height[i], height[i + 1]) >= least[i]);
    states->open[i] = some;
    states->lit[i] = some & -int32_t(lane::min(height[i], height[i + 1]) >= most[i]);
  }
}

// What is lit of the bins of a block: above the cut, or, with the light from behind, below it.
void AirLight::cut_bins(const ViewRay& v, int number, LitBins* lit) const {
  const float* const edges = planes_.edges() + number * block;
  const float* const blocked = planes_.blocked(v.plane) + number * block;
  if (v.slant > 0) {
    for (int i = 0; i < block; ++i) {
      const float begin = lane::clamp(edges[i], v.first, v.last), end = lane::clamp(edges[i + 1], v.first, v.last);
      lit->begin[i] = lane::clamp((blocked[i] - v.lift) * v.slant, begin, end), lit->end[i] = end;
    }
  } else {
    for (int i = 0; i < block; ++i) {
      const float begin = lane::clamp(edges[i], v.first, v.last), end = lane::clamp(edges[i + 1], v.first, v.last);
      lit->begin[i] = begin, lit->end[i] = lane::clamp((blocked[i] - v.lift) * v.slant, begin, end);
    }
  }
}

// The bins of a block, each cut where its shadow begins, and each in closed form.
void AirLight::add_steep_bins(const ViewRay& v, int number, LightSums* sums) const {
  const float* const edges = planes_.edges() + number * block;
  const float* const blocked = planes_.blocked(v.plane) + number * block;
  const float* const entry = planes_.bounded() ? planes_.entry(v.plane) + number * block : nullptr;
  const RGB* const tint = planes_.tinted() ? planes_.tint(v.plane) + number * block : nullptr;
  const float per_u = 1 / v.sine;
  alignas(64) float s[block + 1], a[block], b[block];
  for (int i = 0; i <= block; ++i) s[i] = lane::clamp(edges[i] * per_u, v.begin, v.end);
  for (int i = 0; i < block; ++i) {
    const float h = s[i] * v.cosine + v.lift, growth = (s[i + 1] - s[i]) * v.cosine;
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

void AirLight::set_coordinates(ViewRay* view) const {
  ViewRay& v = *view;
  v.first = v.begin * v.sine, v.last = v.end * v.sine;
  v.slant = v.cosine == 0 ? most_slant : std::clamp(v.sine / v.cosine, -most_slant, most_slant);
}

RGB AirLight::parallel(const Segment& segment) const {
  if (unbounded_ && (haze_.density.is_constant() ? haze_.sigma_t.max() > 0 : rise_ < 0)) return {};
  ViewRay v = view_of(segment);
  const float absorbs = haze_.density.is_constant() ? haze_.sigma_t.min() : 0;
  if (absorbs > 0) v.end = std::min(v.end, v.begin + spent_depth / absorbs);
  set_coordinates(&v);
  LightSums sums;
  const float last_edge = planes_.edge(planes_.bins()), per_u = 1 / v.sine;
  if (v.first < last_edge) scan(v, &sums);
  // Beyond the bins nothing stands in the way.
  if (planes_.settings().open && v.last > last_edge)
    add_run(v, std::clamp(last_edge * per_u, v.begin, v.end), v.end, &sums);
  const float phase = haze_.phase.eval(-segment.d, planes_.frame().n);
  RGB out;
  for (int c = 0; c < 3; ++c) {
    const int from = sums_wanted() == 1 ? 0 : c;
    out[c] = haze_.sigma_s[c] * phase * (float(sums.of[c]) + sums.bins.sum(from) * per_u);
  }
  return out;
}

int AirLight::lit(const Segment& segment, const float* begin, const float* end, int n, RGB* out) const {
  ViewRay v = view_of(segment);
  const float start = v.begin;
  int at = 0;  // the block where a piece begins
  for (int i = 0; i < n; ++i) {
    v.begin = start + begin[i], v.end = start + end[i];
    lamp_ ? lamp_->place(&v) : set_coordinates(&v);
    if (i == 0) {
      at = std::min(planes_.bin_of(v.first) / block, planes_.blocks() - 1);
      while (at > 0 && planes_.block_edges()[at] > v.first) --at;
    }
    out[i] = lit_of(v, &at);
    // By its length, which its coordinates tell with fewer digits.
    if (!lamp_)
      out[i] *= (end[i] - begin[i]) / std::max(v.last - v.first, 1e-30f);
    else
      out[i] *= 1 / v.nearest;
  }
  return v.plane;
}

// What of [first, last] is lit, times tints. `at`: the block of `first`, or one before; moved on.
RGB AirLight::lit_of(const ViewRay& v, int* at) const {
  const float* const edges = planes_.block_edges();
  const int all = planes_.blocks();
  while (*at + 1 < all && edges[*at + 1] <= v.first) ++*at;
  RGB sum;
  for (int b = *at; b < all && edges[b] < v.last; ++b) {
    const float most = planes_.most(v.plane)[b], least = planes_.least(v.plane)[b];
    if (least == infinity) continue;
    const float from = std::max(edges[b], v.first), to = std::min(edges[b + 1], v.last);
    const auto height = [&](float u) { return u / v.slant + v.lift; };
    const bool free = most == -infinity || (!lamp_ && std::min(height(from), height(to)) >= most);
    const bool even = planes_.marks(v.plane)[b] & ScanPlanes::even_tint;
    const RGB* const tint = planes_.tinted() ? planes_.tint(v.plane) + b * block : nullptr;
    if (free && even) {
      sum += (tint ? *tint : RGB(1)) * (to - from);
      continue;
    }
    if (!lamp_ && std::max(height(from), height(to)) < least) continue;
    LitBins lit;
    lamp_ ? lamp_->cut_bins(v, b, &lit) : cut_bins(v, b, &lit);
    if (even) {
      float length = 0;
      for (int i = 0; i < block; ++i) length += lit.end[i] - lit.begin[i];
      sum += (tint ? *tint : RGB(1)) * length;
    } else {
      for (int i = 0; i < block; ++i) sum += tint[i] * (lit.end[i] - lit.begin[i]);
    }
  }
  // Beyond the bins nothing stands in the way.
  const float beyond = std::max(planes_.edge(planes_.bins()), v.first);
  if (!lamp_ && v.last > beyond) sum += RGB(v.last - beyond);
  return sum;
}

RGB AirLight::from_lamp(const Segment& segment) const {
  ViewRay v = view_of(segment);
  lamp_->place(&v);
  LightSums sums;
  scan(v, &sums);
  RGB out;
  for (int c = 0; c < 3; ++c)
    out[c] = haze_.sigma_s[c] * (float(sums.of[c]) + sums.bins.sum(sums_wanted() == 1 ? 0 : c));
  return out;
}

}  // namespace dapple::shafts
