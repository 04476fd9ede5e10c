// SPDX-License-Identifier: Apache-2.0
#include "dapple/impostor/image_view.h"

#include <algorithm>
#include <stdexcept>
#include <tuple>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"

namespace dapple::impostor {

using depthimage::LevelChoice;
using depthimage::Placement;
using depthimage::ScreenMap;
using depthimage::SplatLevel;
using depthimage::SplatObject;
using depthimage::SplatTile;

namespace {

// Pixels a side of draws that tiles take or leave as a whole: to look at all chunks of such in each tile costs less
// than to sort them into tiles, and what stands behind full tiles costs nothing.
constexpr int small_draw = 48;
constexpr size_t few_chunks = 256;

}  // namespace

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
             (resolution_.y + SplatTile::side - 1) / SplatTile::side) {
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
  const size_t count = scene.traced.single_count();
  std::vector<LevelChoice> choices(count);
  const auto object_of = [&](size_t i) -> const SplatObject* {
    const uint32_t object = scene.traced.object_of(uint32_t(i));
    return scene.traced.is_animated(uint32_t(i)) || object >= images.objects.size() ? nullptr
                                                                                    : images.objects[object].get();
  };
  const auto world_of = [&](size_t i) {
    Placement world;
    scene.traced.instance_rows(uint32_t(i), 0, world.m);
    return world;
  };
  const auto draws_of = [](const LevelChoice& c) { return c.ray_share < LevelChoice::ray_steps ? c.count : 0; };
  parallel_ranges(count, 1024, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i)
      if (const SplatObject* object = object_of(i))
        choices[i] = LevelChoice(*object, world_of(i), camera_, resolution_, texel_pixels, i);
  });
  size_t drawn = 0;
  for (const LevelChoice& c : choices) drawn += size_t(draws_of(c));
  draws_.reserve(drawn), placements_.reserve(drawn);
  by_rays += scene.traced.instance_count() - count;
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
    for (int u = 0; u < draws_of(c); ++u) {
      const Placement world = world_of(i);
      const ScreenMap map = camera_.after(world);
      draws_.push_back({object, c.use[size_t(u)].level, uint32_t(i), c.use[size_t(u)].samples, c.ray_share, map,
                        object->reach(map, resolution_)});
      placements_.push_back(world);
    }
  }
}

// The pixels that a chunk may touch, [min, max], within the film; empty if there are none.
Box2i ImageView::pixels_of(size_t draw_index, const SplatLevel& level, const SplatLevel::Chunk& chunk,
                           float* nearest) const {
  const SplatTile::Draw& draw = draws_[draw_index];
  Box2f film;
  *nearest = infinity;
  float border = 0;
  for (int c = 0; c < 8; ++c) {
    const V3f p(c & 1 ? chunk.box.max.x : chunk.box.min.x, c & 2 ? chunk.box.max.y : chunk.box.min.y,
                c & 4 ? chunk.box.max.z : chunk.box.min.z);
    *nearest = std::min(*nearest, draw.map.apply(ScreenMap::Z, p));
    const float W = draw.map.apply(ScreenMap::W, p);
    if (!(W > 0)) return {V2i(0, 0), resolution_ - V2i(1, 1)};
    border = std::max(border, draw.reach * level.texel / W);
    film.extendBy(draw.map.film(p));
  }
  // What a texel's parallelogram reaches from its middle.
  const float steep = draw.object->one_sided ? SplatObject::steepest : SplatObject::steepest_owned;
  *nearest -= 0.6f * level.texel * (1 + steep) * placements_[draw_index].scale();
  border += 0.5f;
  const auto pixel = [](float x, int most) { return int(std::clamp(std::floor(x), -1.0f, float(most))); };
  const Box2i all(V2i(pixel(film.min.x - border, resolution_.x), pixel(film.min.y - border, resolution_.y)),
                  V2i(pixel(film.max.x + border, resolution_.x), pixel(film.max.y + border, resolution_.y)));
  return {V2i(std::max(all.min.x, 0), std::max(all.min.y, 0)),
          V2i(std::min(all.max.x, resolution_.x - 1), std::min(all.max.y, resolution_.y - 1))};
}

// Into the lists of tiles.
void ImageView::sort_chunks() {
  struct Found {
    uint32_t tile;
    Work work;
  };
  constexpr int side = SplatTile::side;
  std::vector<std::vector<Found>> found(draws_.size());
  parallel_for(draws_.size(), [&](size_t d) {
    const SplatTile::Draw& draw = draws_[d];
    const SplatLevel& level = draw.object->levels[size_t(draw.level)];
    const auto add = [&](const Box2i& pixels, Work work) {
      for (int y = pixels.min.y / side; y * side <= pixels.max.y; ++y)
        for (int x = pixels.min.x / side; x * side <= pixels.max.x; ++x) {
          work.x0 = uint8_t(std::max(pixels.min.x - x * side, 0)) & 15u;
          work.x1 = uint8_t(std::min(pixels.max.x - x * side, side - 1)) & 15u;
          work.y0 = uint8_t(std::max(pixels.min.y - y * side, 0)) & 15u;
          work.y1 = uint8_t(std::min(pixels.max.y - y * side, side - 1)) & 15u;
          found[d].push_back({uint32_t(y * tiles_.x + x), work});
        }
    };
    if (!draw.object->one_sided && level.chunks.size() <= few_chunks) {
      SplatLevel::Chunk whole{draw.object->box, 0, 0};
      whole.box.min -= V3f(level.texel), whole.box.max += V3f(level.texel);
      Work work{uint32_t(d), Work::all_chunks, 0, 0, 0, 0, 0};
      const Box2i pixels = pixels_of(d, level, whole, &work.nearest);
      if (pixels.max.x - pixels.min.x < small_draw && pixels.max.y - pixels.min.y < small_draw)
        return add(pixels, work);
    }
    for (uint32_t c = 0; c < level.chunks.size(); ++c) {
      const auto& chunk = level.chunks[c];
      // By the axis of the camera: all that it sees of a far object it sees along nearly one direction.
      if (draw.object->one_sided && !(draw.map.apply_vector(ScreenMap::Z, draw.object->frames[chunk.view].w) < 0))
        continue;
      Work work{uint32_t(d), c, 0, 0, 0, 0, 0};
      const Box2i pixels = pixels_of(d, level, chunk, &work.nearest);
      add(pixels, work);
    }
  });
  first_.assign(size_t(tiles_.x) * size_t(tiles_.y) + 1, 0);
  for (size_t d = 0; d < draws_.size(); ++d) {
    fragments += draws_[d].object->levels[size_t(draws_[d].level)].fragments.size();
    for (const Found& f : found[d]) ++first_[f.tile + 1];
  }
  for (size_t t = 1; t < first_.size(); ++t) first_[t] += first_[t - 1];
  work_.resize(first_.back());
  std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
  for (uint32_t d = 0; d < draws_.size(); ++d)
    for (const Found& f : found[d]) work_[next[f.tile]++] = f.work;
  parallel_ranges(first_.size() - 1, 16, [&](size_t begin, size_t end) {
    for (size_t t = begin; t < end; ++t)
      std::sort(work_.begin() + first_[t], work_.begin() + first_[t + 1], [](const Work& a, const Work& b) {
        return std::tie(a.nearest, a.draw, a.chunk) < std::tie(b.nearest, b.draw, b.chunk);
      });
  });
}

std::span<const ImageView::Work> ImageView::work_of(const V2i& tile) const {
  const size_t t = size_t(tile.y) * size_t(tiles_.x) + size_t(tile.x);
  return {work_.data() + first_[t], work_.data() + first_[t + 1]};
}

}  // namespace dapple::impostor
