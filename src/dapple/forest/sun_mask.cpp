// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/sun_mask.h"

#include <stdexcept>

#include "dapple/base/parallel.h"

namespace dapple::forest {

SunMask::SunMask(const SlabMap& map, double tangent, const SunSamples& samples) : map_(map), samples_(samples) {
  const float scale = float(tangent) * map.frame().slab / map.frame().pitch;
  std::vector<SlabStep> steps;
  for (int s = 0; s < samples.sets(); ++s)
    for (int i = 0; i < samples.count(); ++i) {
      const V2f p = samples.point(s, i), g = samples.dither(s, i);
      steps.push_back({p.x * scale, p.y * scale, g.x, g.y});
      if (int(steps.size()) == SlabPaths::most_rays || i + 1 == samples.count()) {
        paths_.emplace_back(steps, map.deep_levels());
        steps.clear();
      }
    }
  groups_ = int(paths_.size()) / samples.sets();
}

int SunMask::passing(const SlabTile& tile, int channel, SlabMap::Receiver from, int set, PathsOfTile* of_tile) const {
  if (from.below <= 0 || tile.words == 0) return samples_.count();
  int passed = 0;
  for (int group = set * groups_; group < (set + 1) * groups_; ++group) {
    const SlabPaths& paths = paths_[size_t(group)];
    const int n = paths.rays();
    int px[SlabPaths::most_rays], py[SlabPaths::most_rays], below[SlabPaths::most_rays];
    for (int i = 0; i < n; ++i) {
      const SlabStep step = paths.step(i);
      px[i] = step.start_x(from.column, from.level), py[i] = step.start_y(from.row, from.level);
      below[i] = from.below_of(step, px[i], py[i]);
    }
    if (tile.levels() <= paths.levels()) {
      std::optional<TilePaths>& here = (*of_tile)[size_t(group)];
      if (!here) here.emplace(paths, tile);
      passed += here->passing(channel, px, py, from.from, below);
    } else {
      for (int i = 0; i < n; ++i) passed += !blocked(tile, channel, paths.step(i), px[i], py[i], from.from, below[i]);
    }
  }
  return passed;
}

void SunMask::visibility(std::span<const V3f> P, std::span<const V3f> N, std::span<const uint16_t> set,
                         std::span<RGB> visible) const {
  if (N.size() != P.size() || set.size() != P.size() || visible.size() != P.size())
    throw std::invalid_argument("receivers' arrays differ in size");
  const MaskFrame& frame = map_.frame();
  const std::vector<Sorted> order = sorted_by_tile(P);
  std::vector<size_t> starts;
  for (size_t i = 0; i < order.size(); ++i)
    if (i == 0 || !order[i].same_tile(order[i - 1])) starts.push_back(i);
  starts.push_back(order.size());
  const float weight = 1 / float(samples_.count());
  parallel_for(starts.size() - 1, [&](size_t t) {
    const std::span<const Sorted> receivers(order.data() + starts[t], starts[t + 1] - starts[t]);
    const TileKey key = map_.tile_of(frame.to_grid(P[receivers[0].receiver]));
    const V2f corner = map_.corner(key);
    ColumnInterest interest(map_.tile_size());
    for (const Sorted& s : receivers) {
      const V3f at = frame.to_grid(P[s.receiver]);
      interest.add(at.x - corner.x, at.y - corner.y, map_.reach(), at.z);
    }
    const SlabTile tile = map_.partial_tile(key, interest);
    PathsOfTile paths(paths_.size());
    for (const Sorted& s : receivers) {
      const uint32_t r = s.receiver;
      const SlabMap::Receiver from = map_.receiver(frame.to_grid(P[r]), frame.slope(N[r]), key, tile);
      for (int c = 0; c < tile.channels; ++c) visible[r][c] = float(passing(tile, c, from, set[r], &paths)) * weight;
      if (tile.channels == 1) visible[r] = RGB(visible[r].r);
    }
  });
}

/// By tile, and in a tile in the given order.
std::vector<SunMask::Sorted> SunMask::sorted_by_tile(std::span<const V3f> P) const {
  std::vector<Sorted> order(P.size());
  parallel_ranges(P.size(), 16384, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const TileKey key = map_.tile_of(map_.frame().to_grid(P[i]));
      order[i] = {uint64_t(uint32_t(key.y)) << 32 | uint32_t(key.x), uint32_t(i)};
    }
  });
  // Neighbours in an image mostly share a tile: runs are sorted, not receivers.
  struct Run {
    uint64_t tile;
    size_t first, count;
  };
  std::vector<Run> runs;
  for (size_t i = 0; i < order.size(); ++i) {
    if (runs.empty() || runs.back().tile != order[i].tile) runs.push_back({order[i].tile, i, 0});
    ++runs.back().count;
  }
  std::stable_sort(runs.begin(), runs.end(), [](const Run& a, const Run& b) { return a.tile < b.tile; });
  std::vector<Sorted> sorted;
  sorted.reserve(order.size());
  for (const Run& r : runs)
    sorted.insert(sorted.end(), order.begin() + std::ptrdiff_t(r.first),
                  order.begin() + std::ptrdiff_t(r.first + r.count));
  return sorted;
}

}  // namespace dapple::forest
