// SPDX-License-Identifier: Apache-2.0
#include "dapple/depthimage/object_picture.h"

#include <memory>

#include "dapple/base/hash.h"

namespace dapple::depthimage {

namespace {

RGB material_color(uint8_t material) {
  KeyedRng rng(hash(material, 1));
  return {rng.next(), rng.next(), rng.next()};
}

// What fragments of a chunk may touch.
Box2f film_of(const ScreenMap& camera, const Box3f& box, float texel) {
  const V3f reach(texel * 0.5f * (1 + SplatObject::steepest));
  Box2f film;
  for (int c = 0; c < 8; ++c) {
    const V3f p(c & 1 ? box.max.x + reach.x : box.min.x - reach.x, c & 2 ? box.max.y + reach.y : box.min.y - reach.y,
                c & 4 ? box.max.z + reach.z : box.min.z - reach.z);
    if (!(camera.apply(ScreenMap::W, p) > 0)) return {V2f(-infinity), V2f(infinity)};
    film.extendBy(camera.film(p));
  }
  return film;
}

bool touches(const Box2f& film, const V2i& tile) {
  const V2f begin(float(tile.x), float(tile.y)), end = begin + V2f(float(SplatTile::side));
  return film.max.x >= begin.x && film.max.y >= begin.y && film.min.x <= end.x && film.min.y <= end.y;
}

RGB normal_color(const V3f& n) {
  return {0.5f * (n.x + 1), 0.5f * (n.y + 1), 0.5f * (n.z + 1)};
}

}  // namespace

ScreenMap orthographic_map(const SplatObject& object, const V3f& to_viewer, int pixels) {
  const V3f up = std::abs(to_viewer.z) > 0.999f ? V3f(0, 1, 0) : V3f(0, 0, 1);
  const V3f right = normalize(cross(up, to_viewer)), over = cross(to_viewer, right);
  const float scale = float(pixels) / std::max(length(object.box.max - object.box.min), 1e-6f),
              middle = 0.5f * float(pixels);
  ScreenMap map;
  for (int k = 0; k < 3; ++k) {
    map.m[ScreenMap::X][k] = right[k] * scale;
    map.m[ScreenMap::Y][k] = -over[k] * scale;
    map.m[ScreenMap::W][k] = 0;
    map.m[ScreenMap::Z][k] = -to_viewer[k];
  }
  map.m[ScreenMap::X][3] = middle - dot(right, object.centre) * scale;
  map.m[ScreenMap::Y][3] = middle + dot(over, object.centre) * scale;
  map.m[ScreenMap::W][3] = 1;
  map.m[ScreenMap::Z][3] = dot(to_viewer, object.centre) + 4 * object.radius;
  return map;
}

ObjectPicture project(const SplatObject& object, int level, const ScreenMap& camera, const V2i& resolution,
                      Shown shown) {
  ObjectPicture out{resolution.x, resolution.y, {}, {}};
  out.color.resize(size_t(resolution.x) * size_t(resolution.y));
  out.alpha.resize(out.color.size());
  const auto tile = std::make_unique<SplatTile>();
  SplatTile::Draw draw;
  draw.object = &object, draw.level = level, draw.map = camera;
  draw.reach = object.reach(camera, resolution);
  const SplatLevel& from = object.levels[size_t(level)];
  std::vector<Box2f> films;
  for (const SplatLevel::Chunk& chunk : from.chunks)
    films.push_back(object.one_sided && !(camera.apply_vector(ScreenMap::Z, object.frames[chunk.view].w) < 0)
                        ? Box2f()
                        : film_of(camera, chunk.box, from.texel));
  const V3f middle = object.centre;
  const float nearest = camera.apply(ScreenMap::Z, middle) - 2 * object.radius;
  for (int y = 0; y < resolution.y; y += SplatTile::side)
    for (int x = 0; x < resolution.x; x += SplatTile::side) {
      tile->start({x, y}, {0.5f, 0.5f}, 0);
      for (size_t c = 0; c < from.chunks.size(); ++c)
        if (touches(films[c], V2i(x, y))) tile->splat(draw, 0, uint32_t(c));
      for (int row = 0; row < SplatTile::samples; ++row)
        for (int column = 0; column < SplatTile::samples; ++column) {
          const int px = x + column / SampleMask::side, py = y + row / SampleMask::side;
          const uint32_t record = tile->record_at(column, row);
          if (px >= resolution.x || py >= resolution.y || record == SplatTile::none) continue;
          const SplatTile::Record& r = tile->record(record);
          const SplatObject::Surface s = object.surface(from, r.view, r.fragment);
          RGB value = s.reflectance + s.transmittance;
          const V3f away(camera.m[3][0], camera.m[3][1], camera.m[3][2]);
          if (shown == Shown::normal) value = normal_color(face_forward(s.normal, -away));
          if (shown == Shown::depth)
            value = RGB(std::clamp(1 - (tile->depth_at(column, row) - nearest) / (4 * object.radius), 0.0f, 1.0f));
          if (shown == Shown::material) value = material_color(from.fragments[r.fragment].material);
          const size_t pixel = size_t(py) * size_t(resolution.x) + size_t(px);
          out.color[pixel] += value * (1.0f / SampleMask::count);
          out.alpha[pixel] += 1.0f / SampleMask::count;
        }
    }
  return out;
}

ObjectPicture show_image(const ObjectImages& images, size_t level_index, size_t view, int layer, Shown shown) {
  const ImageLevel& level = images.levels[level_index];
  const LayeredImage& image = level.views[view];
  const ViewFrame frame(images.directions[view]);
  const int n = level.resolution;
  ObjectPicture out{n, n, {}, {}};
  out.color.resize(size_t(n) * size_t(n));
  out.alpha.resize(out.color.size());
  for (int row = 0; row < n; ++row)
    for (int column = 0; column < n; ++column) {
      const size_t texel = size_t(row) * size_t(n) + size_t(column);
      const size_t pixel = size_t(n - 1 - row) * size_t(n) + size_t(column);  // v goes up
      const uint32_t first = image.first[texel], end = image.first[texel + 1];
      unsigned covered = 0;
      for (uint32_t f = first; f < end; ++f) {
        if (layer >= 0 && f != first + uint32_t(layer)) continue;
        const Fragment& fragment = image.fragments[f];
        const ImageMaterial& m = images.materials[fragment.material];
        RGB value;
        for (int c = 0; c < 3; ++c)
          value[c] = decode_share(fragment.reflectance[c], m.reflectance[c]) +
                     decode_share(fragment.transmittance[c], m.transmittance[c]);
        if (shown == Shown::normal) value = normal_color(face_forward(decode_normal(fragment.shading_normal), frame.w));
        if (shown == Shown::depth) value = RGB(1 - float(fragment.depth) / 65535);
        if (shown == Shown::material) value = material_color(fragment.material);
        const float part = float(std::popcount(fragment.mask & ~covered)) / SampleMask::count;
        covered |= fragment.mask;
        out.color[pixel] += value * part;
        out.alpha[pixel] += part;
      }
      if (shown == Shown::layers) {
        out.color[pixel] = RGB(std::min(1.0f, float(end - first) / 16));
        out.alpha[pixel] = 1;
      }
    }
  return out;
}

}  // namespace dapple::depthimage
