// SPDX-License-Identifier: Apache-2.0
#include "dapple/gi/hemisphere.h"

#include <algorithm>
#include <cmath>

#include "dapple/gi/hemisphere_numbers.h"

namespace dapple::gi {

namespace {

// What light from a ring loses of its irradiance when the receiver is turned by this, whichever way, over 1 - its
// cosine.
constexpr float turn = HemisphereNumbers::turn;
float loss_by_turning(float x0, float x1) {
  constexpr int steps = 16, ways = 64;
  float kept = 0;
  for (int i = 0; i < steps; ++i) {
    const float sine2 = lerp((float(i) + 0.5f) / steps, x0, x1), cosine = safe_sqrt(1 - sine2), sine = std::sqrt(sine2);
    for (int j = 0; j < ways; ++j)
      kept +=
          std::max(0.0f, cosine * std::cos(turn) + sine * std::sin(turn) * std::cos(2 * pi * float(j) / ways)) / cosine;
  }
  return (1 - kept / (steps * ways)) / (1 - std::cos(turn));
}

// Mean slope of L over time: a fit with a mean of its own to each few strata that lie side by side, so that what
// differs with direction does not count. `time` is stratified in each.
RGB slope_over_time(int count, const RGB* L, const float* time) {
  constexpr int side_by_side = 4;
  RGB sum;
  float square = 0;
  for (int first = 0; first + side_by_side <= count; first += side_by_side) {
    float mean = 0;
    for (int i = 0; i < side_by_side; ++i) mean += time[first + i] / side_by_side;
    for (int i = 0; i < side_by_side; ++i) {
      sum += L[first + i] * (time[first + i] - mean);
      square += sqr(time[first + i] - mean);
    }
  }
  return square > 0 ? sum * (1 / square) : RGB();
}

}  // namespace

HemisphereStrata::HemisphereStrata(int rays)
    : rings_(std::max(1, int(std::lround(std::sqrt(float(rays) / pi))))),
      sectors_(std::max(1, int(std::lround(float(rays) / float(rings_))))) {
  const auto integral_of_tangent = [](float sine) { return std::asin(sine) - sine * safe_sqrt(1 - sine * sine); };
  for (int j = 0; j < rings_; ++j) {
    const float low = std::sqrt(float(j) / float(rings_)), high = std::sqrt(float(j + 1) / float(rings_));
    ring_.push_back({low, high, (integral_of_tangent(high) - integral_of_tangent(low)) * float(rings_),
                     loss_by_turning(sqr(low), sqr(high))});
  }
  const auto at = [&](float k) {
    return V2f(std::cos(2 * pi * k / float(sectors_)), std::sin(2 * pi * k / float(sectors_)));
  };
  for (int k = 0; k < sectors_; ++k) sector_.push_back({at(float(k) + 0.5f), at(float(k))});
}

V3f HemisphereStrata::direction(int i, float x, float y) const {
  const int ring = i / sectors_, sector = i % sectors_;
  const float sine = std::sqrt((float(ring) + x) / float(rings_)), phi = 2 * pi * (float(sector) + y) / float(sectors_);
  return {sine * std::cos(phi), sine * std::sin(phi), safe_sqrt(1 - sine * sine)};
}

RGB IrradianceRecord::at(float ds, float dt, const V3f& n, float time) const {
  const RGB e = E + by_place[0] * ds + by_place[1] * dt + by_normal[0] * n.x + by_normal[1] * n.y +
                by_normal[2] * (n.z - 1) + by_time * time;
  return {std::max(e.r, 0.0f), std::max(e.g, 0.0f), std::max(e.b, 0.0f)};
}

IrradianceRecord integrate_hemisphere(const HemisphereStrata& strata, const RGB* L, const float* r, const float* time) {
  const int rings = strata.rings(), sectors = strata.sectors();
  const int near_rings = rings < HemisphereNumbers::rings_without_last ? rings : rings - 1;
  IrradianceRecord out;
  out.distance = infinity;
  for (int k = 0; k < sectors; ++k) {
    const int before = (k + sectors - 1) % sectors;
    RGB tilt, outwards, around;
    for (int j = 0; j < rings; ++j) {
      const auto& ring = strata.ring(j);
      const int i = j * sectors + k, beside = j * sectors + before, inside = i - sectors;
      out.E += L[i];
      tilt += L[i] * ring.tangent;
      out.by_normal[2] += L[i] * ring.by_pole;
      if (j < near_rings) out.distance = std::min(out.distance, r[i]);
      around += (L[i] - L[beside]) * ((ring.sine_outside - ring.sine) / std::min(r[i], r[beside]));
      if (j > 0) outwards += (L[i] - L[inside]) * (ring.sine * (1 - sqr(ring.sine)) / std::min(r[i], r[inside]));
    }
    const auto& sector = strata.sector(k);
    outwards *= 2 * pi / float(sectors);
    out.by_place[0] += outwards * sector.middle.x - around * sector.edge.y;
    out.by_place[1] += outwards * sector.middle.y + around * sector.edge.x;
    out.by_normal[0] += tilt * sector.middle.x;
    out.by_normal[1] += tilt * sector.middle.y;
  }
  const float scale = pi / float(strata.count());
  out.E *= scale;
  for (RGB& g : out.by_normal) g *= scale;
  if (time) out.by_time = slope_over_time(strata.count(), L, time) * pi;
  // Where light grows by as much as it is, nothing may be said of what is further away (Krivanek 2006).
  float slope2 = 0;
  for (const RGB& g : out.by_place) slope2 += sqr(std::max({std::abs(g.r), std::abs(g.g), std::abs(g.b)}));
  if (!(slope2 < infinity)) {
    out.by_place[0] = out.by_place[1] = RGB();
    out.distance = 0;
  } else if (slope2 > 0) {
    out.distance = std::min(out.distance, out.E.max() / std::sqrt(slope2));
  }
  return out;
}

}  // namespace dapple::gi
