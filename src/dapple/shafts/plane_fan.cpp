// SPDX-License-Identifier: Apache-2.0
#include "dapple/shafts/plane_fan.h"

#include <vector>

namespace dapple::shafts {

namespace {
constexpr int most_planes = 1 << 20;
}

float azimuth(const Frame& axis, const V3f& d) {
  return std::atan2(dot(d, axis.t), dot(d, axis.s));
}

PlaneFan fit_planes(const Frame& axis, std::span<const FilmDirection> corners, std::span<const FilmDirection> inside,
                    float spacing) {
  PlaneFan fan;
  float sweep = 2 * pi;
  if (!corners.empty()) {
    // The azimuths of a convex cone that holds neither the axis nor its opposite are an arc below pi, which ends at
    // corners: then these leave a gap above pi. Else no gap is.
    std::vector<float> at;
    for (const FilmDirection& c : corners) at.push_back(azimuth(axis, c.d));
    std::sort(at.begin(), at.end());
    for (size_t i = 0; i < at.size(); ++i) {
      const bool last = i + 1 == at.size();
      const float gap = last ? at[0] + 2 * pi - at[i] : at[i + 1] - at[i];
      if (!(gap > pi)) continue;
      fan.closed = false;
      fan.first = last ? at[0] : at[i + 1] - 2 * pi;
      sweep = 2 * pi - gap;
    }
  }
  // Pixels from plane to plane a radian of azimuth.
  float density = 0;
  for (const std::span<const FilmDirection> part : {corners, inside})
    for (const FilmDirection& f : part)
      density = std::max(density, length(cross(f.d, axis.n)) / std::max(f.spread, 1e-9f));
  const float count = std::ceil(sweep * density / spacing);
  fan.planes = int(std::clamp(count, 3.0f, float(most_planes))) + (fan.closed ? 0 : 1);
  fan.step = std::max(sweep, 1e-6f) / float(fan.closed ? fan.planes : fan.planes - 1);
  return fan;
}

}  // namespace dapple::shafts
