// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/slab_map.h"

#include <stdexcept>

#include "dapple/forest/tile_raster.h"

namespace dapple::forest {

namespace {

constexpr int most_drift = 512;
constexpr float too_far = 5e8f;
constexpr float bent = 0.25f;  // more slabs, and more of its slope, that a bent surface may reach

/// Of the longest straight line along d through a box.
float longest_chord(const Box3f& box, const V3f& d) {
  float length = infinity;
  for (int a = 0; a < 3; ++a)
    if (std::abs(d[a]) > 1e-6f) length = std::min(length, (box.max[a] - box.min[a]) / std::abs(d[a]));
  return length;
}

}  // namespace

SlabMap::SlabMap(const FacetScene& scene, const V3f& to_light, double spread, const SlabResolution& r, TileStore& store,
                 uint32_t number)
    : scene_(scene), store_(store), number_(number), tile_(r.tile) {
  if (r.levels < SlabResolution::least_levels || r.levels > SlabResolution::most_levels)
    throw std::invalid_argument("shadow masks have from " + std::to_string(SlabResolution::least_levels) + " to " +
                                std::to_string(SlabResolution::most_levels) + " levels");
  if (!(r.pitch >= 0 && std::isfinite(r.pitch)))
    throw std::invalid_argument("the pixels of shadow masks must be above 0 m");
  if (r.tile < 16 || r.tile > 1024)
    throw std::invalid_argument("tiles of shadow masks have from 16 to 1024 pixels a side");
  const Box3f& box = scene.bounds();
  float depth = box.isEmpty() ? 1 : longest_chord(box, to_light);
  if (!(depth > 0)) depth = std::max({length(box.max - box.min) * 1e-3f, 1e-6f});  // all in one plane
  const float slab = depth / float(r.levels);
  frame_ = MaskFrame(to_light, r.pitch > 0 ? r.pitch : slab / 2, slab);
  const double step = spread * double(frame_.slab / frame_.pitch);
  usual_levels_ = (r.levels / SlabTile::word_bits + 1) * SlabTile::word_bits;
  const double drift = step * usual_levels_;
  if (step > 1 || drift > most_drift)
    throw std::invalid_argument("the light is too wide for its shadow mask: its rays drift by " + std::to_string(step) +
                                " pixels a slab and " + std::to_string(int(drift)) + " in all, at most 1 and " +
                                std::to_string(most_drift) + "; wider pixels or fewer levels help");
  border_ = int(std::ceil(drift)) + 3;
}

int SlabMap::deep_levels() const {
  const int words = int(std::ceil(2 * float(tile_size()) * frame_.pitch / frame_.slab / float(SlabTile::word_bits)));
  return usual_levels_ + std::min(words, 64) * SlabTile::word_bits;
}

TileKey SlabMap::tile_of(const V3f& grid) const {
  const auto index = [&](float v) { return int32_t(std::floor(std::clamp(v, -too_far, too_far) / float(tile_))); };
  return {number_, index(grid.x), index(grid.y)};
}

TileStore::TilePtr SlabMap::tile(const TileKey& key) const {
  return store_.fetch(key, [&] { return make(key, nullptr); });
}

SlabTile SlabMap::partial_tile(const TileKey& key, const ColumnInterest& interest) const {
  return make(key, &interest);
}

SlabTile SlabMap::make(const TileKey& key, const ColumnInterest* interest) const {
  thread_local TileRaster raster;
  return raster.make(scene_, frame_,
                     {int64_t(key.x) * tile_ - border_, int64_t(key.y) * tile_ - border_, tile_size(), top_of(key)},
                     interest);
}

// Above the scene's box over the tile. Paths count from there, so it is a function of the key alone, whatever is in the
// tile.
int SlabMap::top_of(const TileKey& key) const {
  const Box3f& box = scene_.bounds();
  if (box.isEmpty()) return 0;
  const V2f from = corner(key);
  const float size = float(tile_size());
  float height = infinity;  // along the light, m
  for (int a = 0; a < 3; ++a) {
    const float l = frame_.to_light[a];
    if (std::abs(l) < 1e-4f) continue;
    // The column's coordinate a at height 0, from the corner that lets the light's line go farthest before it leaves
    // the box.
    const float x = frame_.x[a] * frame_.pitch, y = frame_.y[a] * frame_.pitch, sign = l > 0 ? 1.0f : -1.0f;
    const float corner_a =
        x * from.x + y * from.y + std::min(sign * x, 0.0f) * sign * size + std::min(sign * y, 0.0f) * sign * size;
    height = std::min(height, ((l > 0 ? box.max[a] : box.min[a]) - corner_a) / l);
  }
  return int(std::floor(std::clamp(-height / frame_.slab, -too_far, too_far))) - 1;
}

SlabMap::Receiver SlabMap::receiver(const V3f& grid, const V2f& slope, const TileKey& key, const SlabTile& tile) const {
  Receiver r;
  r.column = std::clamp(grid.x - float(key.x) * float(tile_), 0.0f, float(tile_)) + float(border_);
  r.row = std::clamp(grid.y - float(key.y) * float(tile_), 0.0f, float(tile_)) + float(border_);
  r.level = std::clamp(grid.z - float(tile.base), -1.0f, float(tile.levels()));
  r.slope = slope;
  const float gain = std::abs(slope.x) + std::abs(slope.y);
  // Slabs are filled as far as a surface rises over half a pixel; the rest is for neighbours that lie otherwise.
  r.rise = (0.5f + bent) * gain + bent;
  r.below = int(std::floor(r.level - 0.5f));
  r.from = std::max(0, r.below - usual_levels_);
  // Pixels that its rays look at reach 3/2 of a pixel from it.
  r.clear = int(std::floor(r.level - gain - r.rise));
  return r;
}

V2f SlabMap::drift(const V3f& d) const {
  const float scale = frame_.slab / (frame_.pitch * std::max(dot(d, frame_.to_light), 1e-6f));
  return {dot(d, frame_.x) * scale, dot(d, frame_.y) * scale};
}

}  // namespace dapple::forest
