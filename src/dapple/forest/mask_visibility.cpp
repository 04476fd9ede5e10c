// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/mask_visibility.h"

#include <stdexcept>
#include <tuple>

#include "dapple/base/hash.h"

namespace dapple::forest {

namespace {
constexpr float margin = 1e-4f;  // radians, of directions' rounding
}

V3f spiral_direction(int i, int n) {
  const double z = (i + 0.5) / n, r = std::sqrt(1 - z * z),
               phi = 2 * std::numbers::pi * std::fmod((i + 0.5) * std::numbers::phi, 1.0);
  return normalize(V3f(float(r * std::cos(phi)), float(r * std::sin(phi)), float(z)));
}

MaskVisibility::MaskVisibility(std::unique_ptr<const FacetScene> scene, std::span<const emitters::NarrowBeam> suns,
                               const Settings& s)
    : scene_(std::move(scene)), store_(s.max_bytes) {
  if (s.sky_directions < 0 || s.sky_directions > most_sky_directions)
    throw std::invalid_argument("masks of the sky have from 0 to " + std::to_string(most_sky_directions) +
                                " directions");
  for (const emitters::NarrowBeam& sun : suns) {
    sun_chord2_.push_back(sqr(2 * std::sin((sun.radius + margin) / 2)));
    maps_.push_back(std::make_unique<SlabMap>(*scene_, sun.to_light, double(std::tan(sun.radius + margin)), s.sun,
                                              store_, uint32_t(maps_.size())));
  }
  for (int i = 0; i < s.sky_directions; ++i) {
    const V3f d = spiral_direction(i, s.sky_directions);
    sky_x_.push_back(d.x), sky_y_.push_back(d.y), sky_z_.push_back(d.z);
    maps_.push_back(std::make_unique<SlabMap>(*scene_, d, 0.0, s.sky, store_, uint32_t(maps_.size())));
  }
}

int MaskVisibility::map_of(const V3f& d) const {
  for (size_t s = 0; s < sun_chord2_.size(); ++s)
    if (comes_from_sun(d, s)) return int(s);
  size_t nearest = 0;
  float most = -infinity;
  for (size_t i = 0; i < sky_x_.size(); ++i) {
    const float cosine = sky_x_[i] * d.x + sky_y_[i] * d.y + sky_z_[i] * d.z;
    if (cosine > most) most = cosine, nearest = i;
  }
  return int(sun_chord2_.size() + nearest);
}

bool MaskVisibility::answers(const V3f&, const V3f&, const V3f& d) const {
  for (size_t s = 0; s < sun_chord2_.size(); ++s)
    if (comes_from_sun(d, s)) return true;
  return !sky_x_.empty() && d.z > 0;
}

void MaskVisibility::visible(const emitters::ShadowRays& rays, RGB* visible) const {
  struct Ordered {
    TileKey key;
    int ray;
    bool operator<(const Ordered& o) const {
      return std::tie(key.map, key.y, key.x, ray) < std::tie(o.key.map, o.key.y, o.key.x, o.ray);
    }
  } order[emitters::ShadowRays::capacity];
  V3f grid[emitters::ShadowRays::capacity];
  for (int i = 0; i < rays.count; ++i) {
    const SlabMap& map = *maps_[size_t(map_of(rays.d[i]))];
    grid[i] = map.frame().to_grid(rays.P[i]);
    order[i] = {map.tile_of(grid[i]), i};
  }
  std::sort(order, order + rays.count);
  TileStore::TilePtr tile;
  for (int o = 0; o < rays.count; ++o) {
    const int i = order[o].ray;
    const SlabMap& map = *maps_[order[o].key.map];
    if (o == 0 || !(order[o].key == order[o - 1].key)) tile = map.tile(order[o].key);
    visible[i] = RGB(1);
    if (tile->words == 0) continue;
    const SlabMap::Receiver from = map.receiver(grid[i], map.frame().slope(rays.Ng[i]), order[o].key, *tile);
    if (from.below <= 0) continue;
    const uint64_t random = hash(rays.key[i], 0x510b);
    SlabStep step;
    step.gx = to_unit_float(random), step.gy = to_unit_float(random << 24);
    if (order[o].key.map < sun_chord2_.size()) {
      const V2f drift = map.drift(rays.d[i]);
      step.sx = drift.x, step.sy = drift.y;
    }
    const int px = step.start_x(from.column, from.level), py = step.start_y(from.row, from.level);
    const int below = from.below_of(step, px, py);
    for (int c = 0; c < tile->channels; ++c)
      if (blocked(*tile, c, step, px, py, from.from, below)) visible[i][c] = 0;
    if (tile->channels == 1) visible[i] = RGB(visible[i].r);
  }
}

}  // namespace dapple::forest
