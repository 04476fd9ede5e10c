// SPDX-License-Identifier: Apache-2.0
#include "dapple/gi/opacity_cache.h"

#include <algorithm>
#include <bit>
#include <functional>
#include <thread>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"
#include "dapple/base/timer.h"
#include "dapple/gi/opacity_numbers.h"
#include "dapple/scene/patch_table.h"

namespace dapple::gi {

using integrate::CacheState;
using pattern::FloatTexturePtr;
using pattern::RgbTexturePtr;
using pattern::ShadingPoints;
using pattern::TextureReads;

namespace {

constexpr int tile_bytes = OpacityCache::tile * OpacityCache::tile;
static_assert(tile_bytes == 4 * OpacityCache::colored_tile * OpacityCache::colored_tile);
constexpr float widest_plane = 0x1p14f;  // |u| and |v| up to here fit the names of tiles
constexpr float time = scene::PatchTable::dicing_time;

uint8_t to_byte(float alpha) {
  return alpha > 0 ? uint8_t(std::lround(std::min(alpha, 1.0f) * 255)) : uint8_t(0);
}

float within_one(float alpha) {
  return std::clamp(alpha, 0.0f, 1.0f);
}
RGB within_one(const RGB& alpha) {
  return clamp(alpha, 0, 1);
}

// Cell number c of a tile.
void store(float alpha, int c, uint8_t* tile) {
  tile[c] = to_byte(alpha);
}
void store(const RGB& alpha, int c, uint8_t* tile) {
  for (int i = 0; i < 3; ++i) tile[4 * c + i] = to_byte(alpha[i]);
  tile[4 * c + 3] = 0;
}

// The name of a tile at a level.
uint64_t place_of(int level, int x, int y) {
  constexpr uint32_t bits = (1u << 28) - 1;
  return uint64_t(level) << 56 | uint64_t(uint32_t(y) & bits) << 28 | (uint32_t(x) & bits);
}

bool deforms(const trace::Shape& shape) {
  if (const auto* mesh = std::get_if<trace::MeshPtr>(&shape)) return !(*mesh)->P_end.empty();
  if (const auto* grids = std::get_if<trace::GridsPtr>(&shape)) return !(*grids)->P_end.empty();
  return false;
}

template <class T>
uint32_t index_in(std::vector<T>* list, const T& item) {
  const auto at = std::find(list->begin(), list->end(), item);
  if (at != list->end()) return uint32_t(at - list->begin());
  list->push_back(item);
  return uint32_t(list->size() - 1);
}

}  // namespace

bool OpacityCache::has_use(const scene::Scene& scene) {
  return std::any_of(scene.bindings.begin(), scene.bindings.end(),
                     [](const auto& b) { return b.alpha && !b.alpha->constant(); });
}

OpacityCache::OpacityCache(scene::Scene& scene, size_t bytes) : scene_(scene) {
  for (uint32_t g = 0; g < scene.bindings.size(); ++g) sources_.push_back(make_source(g));
  decode_pictures(bytes / 2);
  const size_t left = bytes - texel_bytes_;
  asked_ = std::vector<std::atomic<uint8_t>>(std::bit_floor(std::min(left / 16, size_t(1) << 18)));
  cache_ = std::make_unique<TileCache>(left - asked_.size(), tile_bytes / 4);
  scene.traced.set_opacity_test(this);
}

OpacityCache::~OpacityCache() {
  scene_.traced.set_opacity_test(&scene_);
}

OpacityCache::Source OpacityCache::make_source(uint32_t geometry) {
  Source s;
  const FloatTexturePtr& alpha = scene_.bindings[geometry].alpha;
  const RgbTexturePtr& colors = scene_.bindings[geometry].opacity;
  if (!alpha || alpha->constant()) {
    s.kind = Kind::constant;
    if (alpha) s.opacity = colors ? *colors->constant() : RGB(*alpha->constant());
    return s;
  }
  s.colored = colors != nullptr;
  const trace::Shape& shape = scene_.traced.shape(geometry);
  if (const auto* mesh = std::get_if<trace::MeshPtr>(&shape)) s.mesh = mesh->get();
  s.triangles = s.mesh && s.mesh->corners == 3;
  const bool in_plane = s.mesh && !s.mesh->uv.empty() && alpha->reads() == TextureReads::uv;
  if (const auto image = alpha->uv_image(); in_plane && image) {
    s.kind = Kind::picture;
    s.number = picture_of(alpha, *image);
  } else if (in_plane) {
    s.kind = Kind::plane;
    s.number = colors ? index_in(&colored_textures_, colors) : index_in(&textures_, alpha);
  } else if (alpha->reads() != TextureReads::time && !deforms(shape)) {
    s.kind = Kind::primitive;
  }
  return s;
}

uint32_t OpacityCache::picture_of(const FloatTexturePtr& texture, const pattern::UvImage& image) {
  const uint32_t number = index_in(&picture_textures_, texture);
  if (number == pictures_.size()) {
    const V2i size = image.image.resolution();
    pictures_.push_back({image, {size.x, size.y, image.sampling.wrap, image.sampling.filter}, {}});
  }
  return number;
}

// Whole pictures as long as they fit, in the order of the scene; others are cached by tiles, to the same values.
void OpacityCache::decode_pictures(size_t bytes) {
  const Timer timer;
  for (Picture& p : pictures_) {
    const size_t width = size_t(p.lattice.width), height = size_t(p.lattice.height);
    if (width * height > bytes - texel_bytes_) continue;
    p.texels.resize(width * height);
    texel_bytes_ += p.texels.size();
    parallel_for((height + tile - 1) / tile, [&](size_t row) {
      const size_t y = row * tile, rows = std::min(height - y, size_t(tile));
      uint8_t block[tile_bytes];
      for (size_t x = 0; x < width; x += tile) {
        compute_texels(p, int(x), int(y), tile, block);
        for (size_t j = 0; j < rows; ++j)
          std::copy_n(block + j * tile, std::min(width - x, size_t(tile)), &p.texels[(y + j) * width + x]);
      }
    });
  }
  decoding_seconds_ = timer.seconds();
}

float OpacityCache::exact(const Hit& hit) const {
  float alpha = 1;
  scene_.opacity(hit.geometry, 1, &hit.primitive, &hit.u, &hit.v, &hit.time, &alpha);
  return alpha;
}

float OpacityCache::seen_opacity(const Hit& hit, Counts* counts) const {
  const Source& s = sources_[hit.geometry];
  switch (s.kind) {
    case Kind::constant:
      return s.opacity.r;
    case Kind::picture:
      return seen_in_picture(s, hit, counts);
    case Kind::exact:
      return exact(hit);
    case Kind::plane:
    case Kind::primitive:
      break;
  }
  const auto c = cell_of(s, hit);
  return c ? float(cell(*c, counts)) / 255 : exact(hit);
}

RGB OpacityCache::seen_colored_opacity(const Hit& hit, Counts* counts) const {
  const Source& s = sources_[hit.geometry];
  if (s.kind == Kind::constant) return s.opacity;
  if (const auto c = s.kind == Kind::exact ? std::nullopt : cell_of(s, hit)) {
    const uint32_t bytes = cell(*c, counts);
    return RGB(float(bytes & 255), float(bytes >> 8 & 255), float(bytes >> 16 & 255)) * (1.0f / 255);
  }
  return OpacityTest::seen_colored_opacity(hit, counts);
}

float OpacityCache::seen_in_picture(const Source& s, const Hit& hit, Counts* counts) const {
  const Picture& p = pictures_[s.number];
  float area;
  const V2f uv = s.mesh->uv_at(hit.primitive, hit.u, hit.v, &area);
  const pattern::UvImage& map = p.image;
  const auto at = p.lattice.corners(image::sane_coordinate(map.scale.x * uv.x + map.offset.x, p.lattice.wrap),
                                    image::sane_coordinate(1 - (map.scale.y * uv.y + map.offset.y), p.lattice.wrap));
  const bool whole = !p.texels.empty();
  if (whole) ++counts->lookups, ++counts->hits;
  const auto texel = [&](int x, int y) {
    if (x < 0 || y < 0) return uint8_t(0);
    return whole ? p.texels[size_t(y) * size_t(p.lattice.width) + size_t(x)]
                 : uint8_t(cell({{&s, hit.geometry, hit.primitive, 0}, x, y}, counts));
  };
  uint8_t value[4];
  for (int k = 0; k < at.count; ++k) value[k] = texel(at.x[k], at.y[k]);
  // Where all agree, which is nearly everywhere, rounding must leave the ends of the range alone.
  if (at.count == 1 || (value[0] == value[1] && value[0] == value[2] && value[0] == value[3]))
    return float(value[0]) / 255;
  float alpha = 0;
  for (int k = 0; k < 4; ++k) alpha += at.weight[k] * float(value[k]);
  return alpha / 255;
}

int OpacityCache::level_of(float area, float width) {
  const float cells = area / sqr(OpacityNumbers::cell_width * width);  // at least, of the whole
  if (!(cells < 0x1p60f)) return max_level + 1;
  const int exponent = int(std::bit_cast<uint32_t>(cells) >> 23) - 127;
  return std::max(min_level, (exponent + 2) >> 1);
}

std::optional<OpacityCache::Cell> OpacityCache::cell_in_plane(const Source& s, const Hit& hit) const {
  float uv_area;
  const V2f uv = s.mesh->uv_at(hit.primitive, hit.u, hit.v, &uv_area);
  const int level = level_of(hit.area / uv_area, hit.width);
  if (level > max_level || !(std::abs(uv.x) < widest_plane) || !(std::abs(uv.y) < widest_plane)) return std::nullopt;
  const float cells = float(1 << level);
  return Cell{{&s, hit.geometry, hit.primitive, level}, int(std::floor(uv.x * cells)), int(std::floor(uv.y * cells))};
}

// Of the unit square of u and v, where Embree's normal does not tell.
float OpacityCache::area_of(const Hit& hit) const {
  const trace::Shape& shape = scene_.traced.shape(hit.geometry);
  if (const auto* curves = std::get_if<trace::CurvesPtr>(&shape)) {
    const geom::CurveSet::ControlPoint* c = &(*curves)->control_points[size_t(hit.primitive) * 4];
    return length(c[3].P - c[0].P) * 2 * std::max({c[0].radius, c[1].radius, c[2].radius, c[3].radius});
  }
  const geom::SurfacePoint middle = scene_.traced.local_surface(hit.geometry, hit.primitive, 0.5f, 0.5f, time);
  return length(cross(middle.dPdu, middle.dPdv));
}

std::optional<OpacityCache::Cell> OpacityCache::cell_on_primitive(const Source& s, const Hit& hit) const {
  const int level = level_of(hit.area > 0 ? hit.area : area_of(hit), hit.width);
  if (level > max_level) return std::nullopt;
  const int cells = 1 << level;
  const float v =
      std::holds_alternative<trace::CurvesPtr>(scene_.traced.shape(hit.geometry)) ? 0.5f + 0.5f * hit.v : hit.v;
  const int x = std::clamp(int(hit.u * float(cells)), 0, cells - 1);
  const int y = std::clamp(int(v * float(cells)), 0, s.triangles ? cells - 1 - x : cells - 1);
  return Cell{{&s, hit.geometry, hit.primitive, level}, x, y};
}

/// Where a cell is in its tile.
struct OpacityCache::CellPlace {
  explicit CellPlace(const Cell& c) : colored(c.lattice.source->colored) {
    const int side = c.lattice.tile(), in_tile = (c.y & (side - 1)) * side + (c.x & (side - 1));
    word = colored ? in_tile : in_tile / 4;
    shift = in_tile % 4 * 8;
  }
  uint32_t of(uint32_t w) const { return colored ? w : w >> shift & 255; }

  bool colored;
  int word, shift;
};

uint32_t OpacityCache::cell(const Cell& c, Counts* counts) const {
  const Lattice& l = c.lattice;
  const bool alone = l.source->kind == Kind::primitive;
  const uint64_t domain = alone ? uint64_t(l.geometry) << 32 | l.primitive
                                : uint64_t(l.source->kind) << 33 | uint64_t(l.source->colored) << 32 | l.source->number;
  const int side = l.tile(), shift = std::countr_zero(unsigned(side));
  const uint64_t key = hash(domain, place_of(l.level + (alone ? 32 : 0), c.x >> shift, c.y >> shift));
  ++counts->lookups;
  const CellPlace at(c);
  uint32_t word;
  if (!cache_->peek(key, at.word, &word)) return miss(c, key, counts);
  ++counts->hits;
  return at.of(word);
}

bool OpacityCache::first_times(uint64_t key) const {
  if (asked_.empty()) return false;
  std::atomic<uint8_t>& count = asked_[key & (asked_.size() - 1)];
  const uint8_t n = count.load(std::memory_order_relaxed);
  if (n >= OpacityNumbers::times_before_tile) return false;
  count.store(uint8_t(n + 1), std::memory_order_relaxed);
  return true;
}

// Computes the tile, or, where that would not pay or is another thread's work, the cell alone.
uint32_t OpacityCache::miss(const Cell& c, uint64_t key, Counts* counts) const {
  const Lattice& l = c.lattice;
  const CellPlace at(c);
  uint32_t words[tile_bytes / 4];
  uint8_t bytes[tile_bytes];
  TileCache::Slot slot;
  const Timer timer;
  const auto found = first_times(key) ? TileCache::Found::refused : cache_->find(key, words, &slot);
  if (found == TileCache::Found::ready) {
    ++counts->hits;
    return at.of(words[at.word]);
  }
  const auto pack = [&bytes](int word) {
    const uint8_t* const b = bytes + 4 * word;
    return uint32_t(b[0]) | uint32_t(b[1]) << 8 | uint32_t(b[2]) << 16 | uint32_t(b[3]) << 24;
  };
  if (found != TileCache::Found::mine) {
    compute(l, c.x, c.y, 1, bytes);
    counts->fill_seconds += timer.seconds();
    return l.source->colored ? pack(0) : bytes[0];
  }
  const int inside = l.tile() - 1;
  try {
    compute(l, c.x & ~inside, c.y & ~inside, l.tile(), bytes);
  } catch (...) {
    cache_->abandon(slot);
    throw;
  }
  for (int w = 0; w < tile_bytes / 4; ++w) words[w] = pack(w);
  cache_->publish(slot, words);
  ++counts->fills;
  counts->fill_seconds += timer.seconds();
  return at.of(words[at.word]);
}

// Cells from (x0, y0) on, `across` of them along each edge, row by row.
void OpacityCache::compute(const Lattice& l, int x0, int y0, int across, uint8_t* out) const {
  if (l.source->kind == Kind::picture) return compute_texels(pictures_[l.source->number], x0, y0, across, out);
  const bool plane = l.source->kind == Kind::plane;
  if (l.source->colored) {
    plane ? compute_plane(*colored_textures_[l.source->number], l.level, x0, y0, across, out)
          : compute_primitive<RGB>(l, x0, y0, across, out);
    return;
  }
  plane ? compute_plane(*textures_[l.source->number], l.level, x0, y0, across, out)
        : compute_primitive<float>(l, x0, y0, across, out);
}

void OpacityCache::compute_texels(const Picture& p, int x0, int y0, int across, uint8_t* out) const {
  float s[tile_bytes], t[tile_bytes], alpha[tile_bytes];
  int n = 0;
  for (int y = y0; y < y0 + across; ++y)
    for (int x = x0; x < x0 + across; ++x, ++n) {
      s[n] = (float(x) + 0.5f) / float(p.lattice.width);
      t[n] = 1 - (float(y) + 0.5f) / float(p.lattice.height);
    }
  image::TextureCoordinates at;
  at.count = n, at.s = s, at.t = t;
  image::TextureSampling nearest = p.image.sampling;
  nearest.filter = image::TextureFilter::point;
  p.image.image.lookup(at, nearest, 1, alpha);
  std::transform(alpha, alpha + n, out, to_byte);
}

template <class T>
void OpacityCache::compute_plane(const pattern::Texture<T>& texture, int level, int x0, int y0, int across,
                                 uint8_t* out) const {
  const int side = points_across(level), per_cell = side * side;
  const float size = 1 / float(1 << level);
  ShadingPoints points;
  T alpha[ShadingPoints::capacity], sum[tile_bytes] = {};
  points.count = 0;
  int first = 0;  // point of the batch, counted over all cells
  const auto evaluate = [&] {
    texture.evaluate(points, alpha);
    for (int i = 0; i < points.count; ++i) sum[(first + i) / per_cell] += within_one(alpha[i]);
    first += points.count;
    points.count = 0;
  };
  for (int c = 0; c < across * across; ++c)
    for (int i = 0; i < per_cell; ++i) {
      const int n = points.count++;
      points.u[n] = (float(x0 + c % across) + (float(i % side) + 0.5f) / float(side)) * size;
      points.v[n] = (float(y0 + c / across) + (float(i / side) + 0.5f) / float(side)) * size;
      points.dudx[n] = points.dudy[n] = points.dvdx[n] = points.dvdy[n] = 0;
      if (points.count == ShadingPoints::capacity) evaluate();
    }
  if (points.count > 0) evaluate();
  for (int c = 0; c < across * across; ++c) store(sum[c] / float(per_cell), c, out);
}

V2f OpacityCache::point_in_cell(uint32_t geometry, uint32_t primitive, bool triangle, int level, int x, int y) {
  const uint64_t random = hash(geometry, primitive, place_of(level, x, y));
  V2f at(to_unit_float(random), to_unit_float(random << 24));
  const int cells = 1 << level;
  if (triangle && x + y + 1 >= cells && at.x + at.y > 1) at = V2f(1 - at.x, 1 - at.y);
  return {(float(x) + at.x) / float(cells), (float(y) + at.y) / float(cells)};
}

template <class T>
void OpacityCache::compute_primitive(const Lattice& l, int x0, int y0, int across, uint8_t* out) const {
  const bool curve = std::holds_alternative<trace::CurvesPtr>(scene_.traced.shape(l.geometry));
  uint32_t primitive[tile_bytes]{};
  float u[tile_bytes]{}, v[tile_bytes]{}, times[tile_bytes]{};
  T alpha[tile_bytes];
  int cell_of[tile_bytes], n = 0;
  for (int c = 0; c < across * across; ++c) {
    const int x = x0 + c % across, y = y0 + c / across;
    store(T(0), c, out);
    if (l.source->triangles && x + y >= 1 << l.level) continue;
    const V2f at = point_in_cell(l.geometry, l.primitive, l.source->triangles, l.level, x, y);
    cell_of[n] = c, primitive[n] = l.primitive, u[n] = at.x, v[n] = curve ? 2 * at.y - 1 : at.y, times[n] = time;
    ++n;
  }
  if constexpr (std::is_same_v<T, RGB>)
    scene_.colored_opacity(l.geometry, n, primitive, u, v, times, alpha);
  else
    scene_.opacity(l.geometry, n, primitive, u, v, times, alpha);
  for (int i = 0; i < n; ++i) store(alpha[i], cell_of[i], out);
}

void OpacityCache::add(const Counts& counts) const {
  Tally& tally = tallies_[std::hash<std::thread::id>()(std::this_thread::get_id()) % tally_count];
  tally.lookups.fetch_add(counts.lookups, std::memory_order_relaxed);
  tally.hits.fetch_add(counts.hits, std::memory_order_relaxed);
  tally.fills.fetch_add(counts.fills, std::memory_order_relaxed);
  tally.fill_nanoseconds.fetch_add(uint64_t(counts.fill_seconds * 1e9), std::memory_order_relaxed);
}

CacheState OpacityCache::state() const {
  CacheState s{"opacity", {}, cache_->evictions(), texel_bytes_ + asked_.size() + cache_->bytes_in_use()};
  for (const Tally& t : tallies_)
    s.counts += {t.lookups.load(), t.hits.load(), t.fills.load(), double(t.fill_nanoseconds.load()) * 1e-9};
  s.counts.fill_seconds += decoding_seconds_;
  s.peak_bytes = s.bytes;
  s.capacity_bytes = texel_bytes_ + asked_.size() + cache_->bytes();
  return s;
}

}  // namespace dapple::gi
