// SPDX-License-Identifier: Apache-2.0
#include "dapple/shafts/uneven_light.h"

#include <array>

namespace dapple::shafts {

using media::RayStrata;

namespace {
constexpr int turns = 16;            // of a lamp: pieces of half a turn
constexpr float least_seen = 1e-6f;  // of the light of the farthest strata
}  // namespace

RGB UnevenLight::in_scattering(const Segment& s, const V3f& o, uint64_t key, const RayStrata* known) const {
  if (known && !lit_.planes().is_lamp()) return light_of(*known, s, o);
  const ScanPlanes& planes = lit_.planes();
  // Beside a lamp pieces are alike in the angle at it.
  std::array<float, turns> also;
  size_t cuts = 0;
  if (planes.is_lamp()) {
    const V3f way = planes.settings().eye + planes.frame().n * planes.settings().lamp - o;
    const float nearest = dot(way, s.d), off = length(way - s.d * nearest);
    for (int i = 1; i < turns; ++i) also[cuts++] = nearest + off * std::tan(pi * (float(i) / turns - 0.5f));
  }
  RayStrata strata;
  medium_.stratify(Ray{o, s.d, infinity, 0}, s.end - s.begin, key, {also.data(), cuts}, &strata);
  return light_of(strata, s, o);
}

RGB UnevenLight::light_of(const RayStrata& strata, const Segment& s, const V3f& o) const {
  if (strata.count == 0) return {};
  const ScanPlanes& planes = lit_.planes();
  const V3f& axis = planes.frame().n;
  const V3f lamp = planes.is_lamp() ? planes.settings().eye + axis * planes.settings().lamp : V3f(0, 0, 0);
  RGB lit[RayStrata::capacity];
  const int plane = lit_.lit(s, strata.begin, strata.end, strata.count, lit);
  const auto& phase = medium_.phase();
  RGB sum;
  for (int i = 0; i < strata.count && strata.through[i].max() > least_seen; ++i) {
    if (lit[i].is_black() || strata.point[i].sigma_s.is_black()) continue;
    const V3f P = o + s.d * strata.at[i];
    const RGB depth = depth_of(P, plane), t = strata.extinction(i);
    const float p = planes.is_lamp() ? phase.eval(-s.d, normalize(lamp - P)) : 1.0f;
    for (int c = 0; c < 3; ++c)
      sum[c] += strata.through[i][c] * media::mean_decay(t[c] * strata.length(i)) * std::exp(-depth[c]) *
                strata.point[i].sigma_s[c] * lit[i][c] * p;
  }
  return planes.is_lamp() ? sum : sum * phase.eval(-s.d, axis);
}

// Where light enters the medium at a surface, only what is behind that.
RGB UnevenLight::depth_of(const V3f& P, int plane) const {
  const ScanPlanes& planes = lit_.planes();
  RGB depth = depths_->at(P);
  if (!planes.bounded()) return depth;
  const V3f& axis = planes.frame().n;
  const ScanPlanes::Settings& s = planes.settings();
  V3f entry;
  if (planes.is_lamp()) {
    const V3f lamp = s.eye + axis * s.lamp, d = normalize(P - lamp);
    const float u = std::acos(std::clamp(-dot(d, axis), -1.0f, 1.0f));
    const float known = planes.entry(plane)[std::min(planes.bin_of(u), planes.bins() - 1)];
    if (!(known > 0) || !(known < infinity)) return depth;
    entry = lamp + d * known;
  } else {
    const float height = dot(P - s.eye, axis),
                u = planes.is_sheaf() ? dot(P - s.eye, planes.across(plane)) : length(P - s.eye - axis * height);
    const float known = planes.entry(plane)[std::min(planes.bin_of(u), planes.bins() - 1)];
    if (known == 0 || !(known < infinity)) return depth;
    entry = P + axis * (-known - height);
  }
  const RGB before = depths_->at(entry);
  for (int c = 0; c < 3; ++c) depth[c] = std::max(depth[c] - before[c], 0.0f);
  return depth;
}

}  // namespace dapple::shafts
