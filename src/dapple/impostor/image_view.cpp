// SPDX-License-Identifier: Apache-2.0
#include "dapple/impostor/image_view.h"

#include <stdexcept>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"

namespace dapple::impostor {

using depthimage::LevelChoice;
using depthimage::Placement;
using depthimage::ScreenMap;
using depthimage::SplatLevel;
using depthimage::SplatObject;
using depthimage::SplatTile;

ScreenMap screen_map(const scene::Camera& camera) {
  const scene::Camera::Settings& s = camera.settings();
  const bool perspective = s.projection == scene::Projection::perspective;
  if (!perspective && s.projection != scene::Projection::orthographic)
    throw std::invalid_argument("a camera that looks all around");
  if (camera.has_lens()) throw std::invalid_argument("a camera with depth of field");
  if (s.camera_to_world.is_animated()) throw std::invalid_argument("a camera that moves");
  const float reach = perspective ? std::tan(radians(s.fov_degrees) / 2) : 1;
  const float x_pixels = float(s.resolution.x) / ((s.screen_max_x - s.screen_min_x) * reach),
              y_pixels = float(s.resolution.y) / ((s.screen_max_y - s.screen_min_y) * reach);
  const float x_begin = s.screen_min_x * reach * x_pixels, y_begin = s.screen_max_y * reach * y_pixels;
  V3f axis[3], origin;
  const Transform& view = camera.world_to_camera();
  origin = view.point(V3f(0, 0, 0));
  for (int k = 0; k < 3; ++k) axis[k] = view.vector(V3f(k == 0, k == 1, k == 2));
  ScreenMap map;
  for (int c = 0; c < 4; ++c) {
    const V3f v = c < 3 ? axis[c] : origin;
    const float w = perspective ? v.z : c == 3 ? 1.0f : 0.0f;
    map.m[ScreenMap::X][c] = v.x * x_pixels - w * x_begin;
    map.m[ScreenMap::Y][c] = -v.y * y_pixels + w * y_begin;
    map.m[ScreenMap::W][c] = w;
    map.m[ScreenMap::Z][c] = v.z;
  }
  // A length across the axis is as long in camera space as the transform says; at a depth there.
  map.scale = std::max(x_pixels, y_pixels) * length(axis[0]);
  return map;
}

ImageView::ImageView(const scene::Scene& scene, const TreeImages& images, float texel_pixels)
    : camera_(screen_map(scene.camera)),
      resolution_(scene.camera.settings().resolution),
      tiles_((resolution_.x + SplatTile::side - 1) / SplatTile::side,
             (resolution_.y + SplatTile::side - 1) / SplatTile::side),
      texel_pixels_(texel_pixels) {
  place_instances(scene, images, texel_pixels);
  sort_chunks();
  const uint8_t most = LevelChoice::ray_steps;
  one_part_ = std::all_of(ray_shares_.begin(), ray_shares_.end(), [](uint8_t s) { return s == 0 || s == most; });
  for (int group = 0; group < LevelChoice::ray_steps; ++group) {
    if (one_part_ && group > 0) {
      parts_[size_t(group)] = parts_[0];
      continue;
    }
    std::vector<uint8_t> there(ray_shares_.size());
    for (size_t i = 0; i < there.size(); ++i) there[i] = group < ray_shares_[i];
    parts_[size_t(group)] = scene.traced.make_part(there);
  }
}

void ImageView::place_instances(const scene::Scene& scene, const TreeImages& images, float texel_pixels) {
  const size_t count = scene.traced.instance_count();
  std::vector<LevelChoice> choices(count);
  std::vector<Placement> worlds(count);
  const auto object_of = [&](size_t i) -> const SplatObject* {
    const uint32_t object = scene.traced.object_of(uint32_t(i));
    return scene.traced.is_animated(uint32_t(i)) || object >= images.objects.size() ? nullptr
                                                                                    : images.objects[object].get();
  };
  parallel_ranges(count, 1024, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const SplatObject* object = object_of(i);
      if (!object) continue;
      scene.traced.instance_rows(uint32_t(i), 0, worlds[i].m);
      choices[i] = LevelChoice(*object, worlds[i], camera_, resolution_, texel_pixels, i);
    }
  });
  ray_shares_.assign(count, LevelChoice::ray_steps);
  for (size_t i = 0; i < count; ++i) {
    const SplatObject* object = object_of(i);
    const LevelChoice& c = choices[i];
    if (!object) {
      ++by_rays;
      continue;
    }
    ray_shares_[i] = c.visible ? uint8_t(c.ray_share) : 0;
    c.visible ? ++(c.count > 0 ? by_images : by_rays) : ++unseen;
    for (int u = 0; u < c.count && c.ray_share < LevelChoice::ray_steps; ++u) {
      draws_.push_back({object, c.use[size_t(u)].level, uint32_t(i), c.use[size_t(u)].samples, c.ray_share,
                        camera_.after(worlds[i])});
      placements_.push_back(worlds[i]);
    }
  }
}

Box2i ImageView::tiles_of(const SplatTile::Draw& draw, const SplatLevel& level, const SplatLevel::Chunk& chunk) const {
  Box2f film;
  bool in_front = true;
  for (int c = 0; c < 8 && in_front; ++c) {
    const V3f p(c & 1 ? chunk.box.max.x : chunk.box.min.x, c & 2 ? chunk.box.max.y : chunk.box.min.y,
                c & 4 ? chunk.box.max.z : chunk.box.min.z);
    in_front = draw.map.apply(ScreenMap::W, p) > 0;
    if (in_front) film.extendBy(draw.map.film(p));
  }
  if (!in_front) return {V2i(0, 0), tiles_};
  // What a texel's parallelogram reaches from its middle.
  const float border =
      1 + texel_pixels_ * (draw.object->one_sided ? 0.5f * (1 + SplatObject::steepest) : 1.5f);
  const auto tile = [](float pixels, int most) {
    return int(std::clamp(std::floor(pixels / float(SplatTile::side)), -1.0f, float(most)));
  };
  Box2i tiles(V2i(tile(film.min.x - border, tiles_.x), tile(film.min.y - border, tiles_.y)),
              V2i(tile(film.max.x + border, tiles_.x) + 1, tile(film.max.y + border, tiles_.y) + 1));
  for (int k = 0; k < 2; ++k)
    tiles.min[k] = std::max(tiles.min[k], 0), tiles.max[k] = std::min(tiles.max[k], tiles_[k]);
  return tiles;
}

// Into the lists of tiles, in the order of draws and chunks.
void ImageView::sort_chunks() {
  struct Found {
    uint32_t tile, chunk;
  };
  std::vector<std::vector<Found>> found(draws_.size());
  parallel_for(draws_.size(), [&](size_t d) {
    const SplatTile::Draw& draw = draws_[d];
    const SplatLevel& level = draw.object->levels[size_t(draw.level)];
    for (uint32_t c = 0; c < level.chunks.size(); ++c) {
      const auto& chunk = level.chunks[c];
      // By the axis of the camera: all that it sees of a far object it sees along nearly one direction.
      if (draw.object->one_sided &&
          !(draw.map.apply_vector(ScreenMap::Z, draw.object->frames[chunk.view].w) < 0))
        continue;
      const Box2i tiles = tiles_of(draw, level, chunk);
      for (int y = tiles.min.y; y < tiles.max.y; ++y)
        for (int x = tiles.min.x; x < tiles.max.x; ++x) found[d].push_back({uint32_t(y * tiles_.x + x), c});
    }
  });
  first_.assign(size_t(tiles_.x) * size_t(tiles_.y) + 1, 0);
  for (size_t d = 0; d < draws_.size(); ++d) {
    fragments += draws_[d].object->levels[size_t(draws_[d].level)].x.size();
    for (const Found& f : found[d]) ++first_[f.tile + 1];
  }
  for (size_t t = 1; t < first_.size(); ++t) first_[t] += first_[t - 1];
  work_.resize(first_.back());
  std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
  for (uint32_t d = 0; d < draws_.size(); ++d)
    for (const Found& f : found[d]) work_[next[f.tile]++] = {d, f.chunk};
}

std::span<const ImageView::Work> ImageView::work_of(const V2i& tile) const {
  const size_t t = size_t(tile.y) * size_t(tiles_.x) + size_t(tile.x);
  return {work_.data() + first_[t], work_.data() + first_[t + 1]};
}

}  // namespace dapple::impostor
