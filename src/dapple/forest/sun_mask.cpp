// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/sun_mask.h"

#include <numeric>
#include <stdexcept>

#include "dapple/base/parallel.h"

namespace dapple::forest {

SunMask::SunMask(const SlabMap& map, double tangent, const SunSamples& samples) : map_(map), samples_(samples) {
  const float scale = float(tangent) * map.frame().slab / map.frame().pitch;
  for (int s = 0; s < samples.sets(); ++s)
    for (int i = 0; i < samples.count(); ++i) {
      const V2f p = samples.point(s, i), g = samples.dither(s, i);
      const SlabStep step{p.x * scale, p.y * scale, g.x, g.y};
      const std::vector<SlabRun> runs = slab_runs(step, map.usual_levels());
      rays_.push_back({step, uint32_t(runs_.size()), uint32_t(runs.size())});
      runs_.insert(runs_.end(), runs.begin(), runs.end());
    }
}

int SunMask::passing(const SlabTile& tile, int channel, const SlabMap::Receiver& from, int set) const {
  const int n = samples_.count();
  if (from.below <= 0 || tile.words == 0) return n;
  const Ray* const rays = rays_.data() + size_t(set) * size_t(n);
  const bool has_runs = tile.levels() <= map_.usual_levels();
  int passed = 0;
  for (int i = 0; i < n; ++i) {
    const SlabStep& step = rays[i].step;
    const int px = step.start_x(from.column, from.level), py = step.start_y(from.row, from.level);
    passed += has_runs ? !blocked(tile, channel, runs_.data() + rays[i].first, rays[i].count, px, py, from.below)
                       : !blocked(tile, channel, step, px, py, from.from, from.below);
  }
  return passed;
}

void SunMask::visibility(std::span<const V3f> P, std::span<const V3f> N, std::span<const uint16_t> set, std::span<RGB> visible) const {
  if (N.size() != P.size() || set.size() != P.size() || visible.size() != P.size()) throw std::invalid_argument("receivers' arrays differ in size");
  struct Sorted {
    int32_t y, x;
    uint32_t receiver;
    bool operator<(const Sorted& o) const { return std::tie(y, x, receiver) < std::tie(o.y, o.x, o.receiver); }
    bool same_tile(const Sorted& o) const { return y == o.y && x == o.x; }
  };
  const MaskFrame& frame = map_.frame();
  std::vector<Sorted> order(P.size());
  parallel_ranges(P.size(), 16384, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const TileKey key = map_.tile_of(frame.to_grid(P[i]));
      order[i] = {key.y, key.x, uint32_t(i)};
    }
  });
  std::sort(order.begin(), order.end());
  std::vector<size_t> starts;
  for (size_t i = 0; i < order.size(); ++i)
    if (i == 0 || !order[i].same_tile(order[i - 1])) starts.push_back(i);
  starts.push_back(order.size());
  const float weight = 1 / float(samples_.count());
  parallel_for(starts.size() - 1, [&](size_t t) {
    const Sorted& first = order[starts[t]];
    TileKey key = map_.tile_of(frame.to_grid(P[first.receiver]));
    const TileStore::TilePtr tile = map_.tile(key);
    for (size_t i = starts[t]; i < starts[t + 1]; ++i) {
      const uint32_t r = order[i].receiver;
      const bool has_surface = length2(N[r]) > 0;
      const SlabMap::Receiver from = map_.receiver(frame.to_grid(P[r]), has_surface ? frame.slope(N[r]) : 0, key, *tile);
      for (int c = 0; c < tile->channels; ++c) visible[r][c] = float(passing(*tile, c, from, set[r])) * weight;
      if (tile->channels == 1) visible[r] = RGB(visible[r].r);
    }
  });
}

}  // namespace dapple::forest
