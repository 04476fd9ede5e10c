// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/ground_visibility.h"

#include <algorithm>
#include <cmath>

namespace dapple::forest {

namespace {

constexpr float least_level = 0.70710678f;  // cosine between a surface's normal and up

/// Between the middles of the four pixels around a place in [0, 1]^2, from the upper left.
RGB bilinear(const Raster& r, const V2f& place) {
  const float x = std::clamp(place.x * float(r.width) - 0.5f, 0.0f, float(r.width - 1)),
              y = std::clamp(place.y * float(r.height) - 0.5f, 0.0f, float(r.height - 1));
  const int i = int(x), j = int(y), right = std::min(i + 1, r.width - 1), below = std::min(j + 1, r.height - 1);
  const float s = x - float(i), t = y - float(j);
  RGB out;
  for (int c = 0; c < r.channels; ++c)
    out[c] = lerp(t, lerp(s, r.at(c, i, j), r.at(c, right, j)), lerp(s, r.at(c, i, below), r.at(c, right, below)));
  return r.channels == 1 ? RGB(out.r) : out;
}

}  // namespace

bool GroundLight::empty() const {
  return sky.values.empty() &&
         std::all_of(beams.begin(), beams.end(), [](const Beam& b) { return b.share.values.empty(); });
}

size_t GroundLight::bytes() const {
  size_t numbers = height.values.size() + sky.values.size();
  for (const Beam& b : beams) numbers += b.share.values.size();
  return numbers * sizeof(float);
}

GroundVisibility::GroundVisibility(GroundLight light, std::shared_ptr<const emitters::Visibility> rest)
    : light_(std::move(light)), rest_(std::move(rest)) {}

bool GroundVisibility::find(const V3f& P, const V3f& Ng, V2f* place) const {
  const Box2f& a = light_.area;
  if (!(std::abs(Ng.z) >= least_level) || !a.intersects(V2f(P.x, P.y)) || length2(P - light_.eye) < sqr(light_.nearest))
    return false;
  *place = {(P.x - a.min.x) / (a.max.x - a.min.x), (a.max.y - P.y) / (a.max.y - a.min.y)};
  // Beside pixels without ground the height is no number.
  return std::abs(bilinear(light_.height, *place).r - P.z) <= light_.tolerance;
}

const Raster* GroundVisibility::share_of(const V3f& d) const {
  const Raster* share = &light_.sky;
  for (const GroundLight::Beam& b : light_.beams)
    if (dot(d, b.to_light) >= b.cosine) share = &b.share;
  return d.z > 0 && !share->values.empty() ? share : nullptr;
}

bool GroundVisibility::answers(const V3f& P, const V3f& Ng, const V3f& d) const {
  V2f place;
  return (share_of(d) && find(P, Ng, &place)) || (rest_ && rest_->answers(P, Ng, d));
}

void GroundVisibility::visible(const emitters::ShadowRays& rays, RGB* visible) const {
  emitters::ShadowRays others;
  int ray[emitters::ShadowRays::capacity];
  for (int i = 0; i < rays.count; ++i) {
    V2f place;
    const Raster* const share = share_of(rays.d[i]);
    if (share && find(rays.P[i], rays.Ng[i], &place)) {
      visible[i] = bilinear(*share, place);
      continue;
    }
    const int k = others.count++;
    others.P[k] = rays.P[i], others.Ng[k] = rays.Ng[i], others.d[k] = rays.d[i], others.key[k] = rays.key[i];
    ray[k] = i;
  }
  if (others.count == 0) return;
  RGB found[emitters::ShadowRays::capacity];
  rest_->visible(others, found);
  for (int k = 0; k < others.count; ++k) visible[ray[k]] = found[k];
}

}  // namespace dapple::forest
