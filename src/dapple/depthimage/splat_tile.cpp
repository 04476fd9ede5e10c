// SPDX-License-Identifier: Apache-2.0
#include "dapple/depthimage/splat_tile.h"

#include <algorithm>

#include "dapple/depthimage/image_numbers.h"

namespace dapple::depthimage {

namespace {

constexpr int grid = SampleMask::side;
constexpr int lanes = SplatLevel::chunk_size;
constexpr int chunks_between = 64;  // of looks at what is full
// Texels' samples between a fragment's middle and the farthest that it is drawn.
constexpr float depth_reach = (0.5f + ImageNumbers::overlap) * float(grid);

using Float8 __attribute__((vector_size(32))) = float;
using Int8 __attribute__((vector_size(32))) = int32_t;

Float8 load(const float* from) {
  Float8 v;
  __builtin_memcpy(&v, from, sizeof(v));
  return v;
}

Float8 load(const int8_t* from) {
  using Byte8 __attribute__((vector_size(8))) = int8_t;
  Byte8 v;
  __builtin_memcpy(&v, from, sizeof(v));
  return __builtin_convertvector(__builtin_convertvector(v, Int8), Float8);
}

template <typename Vector, typename Number>
void store(Number* to, const Vector& v) {
  static_assert(sizeof(v) == 8 * sizeof(Number));
  __builtin_memcpy(to, &v, sizeof(v));
}

Float8 larger(const Float8& p, const Float8& q) {
  return p > q ? p : q;
}

Float8 smaller(const Float8& p, const Float8& q) {
  return p < q ? p : q;
}

// Of values that fit an int: the least whole number not below.
Float8 ceiling(const Float8& v) {
  const Float8 whole = __builtin_convertvector(__builtin_convertvector(v, Int8), Float8);
  return whole + __builtin_convertvector(-(v > whole), Float8);
}

bool any(const Int8& v) {
  uint64_t parts[4];
  __builtin_memcpy(parts, &v, sizeof(v));
  return (parts[0] | parts[1] | parts[2] | parts[3]) != 0;
}

// A bit for each lane.
uint32_t bits_of(const Int8& v) {
  const Int8 bits = v & Int8{1, 2, 4, 8, 16, 32, 64, 128};
  uint64_t parts[4];
  __builtin_memcpy(parts, &bits, sizeof(bits));
  const uint64_t all = parts[0] | parts[1] | parts[2] | parts[3];
  return uint32_t(all | all >> 32);
}

float larger(float p, float q) {
  return p > q ? p : q;
}

}  // namespace

/// The fragments of a chunk in the tile, structure of arrays: where, in sub-samples, each lies, and how to get from
/// there to its texel.
struct SplatTile::Projection {
  const SplatLevel::Lanes* from = nullptr;
  alignas(32) float film_x[lanes], film_y[lanes], inverse_w[lanes], depth[lanes];
  alignas(32) float x[lanes], y[lanes];
  alignas(32) int32_t pixel[lanes], may_show[lanes];
  alignas(32) float x0[lanes], x1[lanes], y0[lanes], y1[lanes];      // all that it may cover
  alignas(32) float a_x[lanes], a_y[lanes], b_x[lanes], b_y[lanes];  // samples of the texel by sub-samples of the film
  alignas(32) float z_a[lanes], z_b[lanes];                          // depth by samples
  alignas(32) float nearest[lanes];
  alignas(32) int32_t covering[lanes];  // of farthest_, as one array: square of pixels about all that it may cover
  float u[4], v[4], n[4];               // rows of the map, of the frame's axes, a texel long

  void place(const ScreenMap& map, float texel, const ViewFrame& frame) {
    for (int r = 0; r < 4; ++r) {
      u[r] = map.apply_vector(ScreenMap::Row(r), frame.u) * texel;
      v[r] = map.apply_vector(ScreenMap::Row(r), frame.v) * texel;
      n[r] = map.apply_vector(ScreenMap::Row(r), frame.w) * texel;
    }
    const auto& m = map.m;
    for (int i = 0; i < lanes; i += width) {
      const Float8 px = load(from->x + i), py = load(from->y + i), pz = load(from->z + i);
      const auto row = [&](int r) { return m[r][0] * px + m[r][1] * py + m[r][2] * pz + m[r][3]; };
      const Float8 inverse = 1 / row(ScreenMap::W);
      store(inverse_w + i, inverse);
      store(film_x + i, row(ScreenMap::X) * inverse);
      store(film_y + i, row(ScreenMap::Y) * inverse);
      store(depth + i, row(ScreenMap::Z));
    }
  }

  /// Which lie in the tile or reach into it.
  void find_near(float dx, float dy, float reach_scale) {
    const Float8 zero{}, end = zero + float(samples - 1);
    for (int i = 0; i < lanes; i += width) {
      const Float8 inverse = load(inverse_w + i);
      const Float8 X = load(film_x + i) * float(grid) + dx, Y = load(film_y + i) * float(grid) + dy,
                   r = reach_scale * inverse, most = end + r;
      store(x + i, X), store(y + i, Y);
      store(may_show + i, (inverse > 0) & (X >= -r) & (Y >= -r) & (X <= most) & (Y <= most));
      const Int8 column = __builtin_convertvector(smaller(larger(X, zero), end), Int8),
                 row = __builtin_convertvector(smaller(larger(Y, zero), end), Int8);
      store(pixel + i, row / grid * side + column / grid);
    }
  }

  float most_inverse_w() const {
    Float8 most{};
    for (int i = 0; i < lanes; i += width) {
      const Float8 here = load(inverse_w + i);
      most = here > most ? here : most;
    }
    float out = 0;
    for (int l = 0; l < width; ++l) out = larger(out, most[l]);
    return out;
  }

  /// Leaves out what lies behind `farthest`, by pixel.
  void hide_behind(const float* farthest, float depth_reach) {
    for (int i = 0; i < lanes; ++i) may_show[i] &= -int32_t(!(farthest[pixel[i]] < depth[i] - depth_reach));
  }

  void find_sides(int i) {
    const Float8 zero{}, end = zero + float(samples - 1);
    const Float8 inverse = load(inverse_w + i), fx = load(film_x + i), fy = load(film_y + i), X = load(x + i),
                 Y = load(y + i), scale = float(grid) * inverse;
    const Float8 slope_u = load(from->slope_u + i), slope_v = load(from->slope_v + i);
    // Sides of the texel's parallelogram: how the film moves where the plane does.
    const Float8 wu = u[2] + slope_u * n[2], wv = v[2] + slope_v * n[2];
    const Float8 xu = (u[0] + slope_u * n[0] - fx * wu) * scale, yu = (u[1] + slope_u * n[1] - fy * wu) * scale,
                 xv = (v[0] + slope_v * n[0] - fx * wv) * scale, yv = (v[1] + slope_v * n[1] - fy * wv) * scale;
    const Float8 inverse_area = float(grid) / (xu * yv - xv * yu);
    store(a_x + i, yv * inverse_area), store(a_y + i, -xv * inverse_area);
    store(b_x + i, -yu * inverse_area), store(b_y + i, xu * inverse_area);
    const Float8 along_a = (u[3] + slope_u * n[3]) / float(grid), along_b = (v[3] + slope_v * n[3]) / float(grid);
    store(z_a + i, along_a), store(z_b + i, along_b);
    store(nearest + i, load(depth + i) - depth_reach * (larger(along_a, -along_a) + larger(along_b, -along_b)));
    const Float8 p = 0.01f * load(from->left + i), q = 0.01f * load(from->right + i),
                 r = 0.01f * load(from->bottom + i), s = 0.01f * load(from->top + i);
    const auto first = [&](const Float8& at, const Float8& along_u, const Float8& along_v) {
      const Float8 least = at + smaller(along_u * p, along_u * q) + smaller(along_v * r, along_v * s);
      return ceiling(smaller(larger(least, zero), end + 1));
    };
    const auto last = [&](const Float8& at, const Float8& along_u, const Float8& along_v) {
      const Float8 most = at + larger(along_u * p, along_u * q) + larger(along_v * r, along_v * s);
      return smaller(larger(most, zero - 1), end);
    };
    const Float8 left = first(X, xu, xv), right = last(X, xu, xv), upper = first(Y, yu, yv), lower = last(Y, yu, yv);
    store(x0 + i, left), store(x1 + i, right), store(y0 + i, upper), store(y1 + i, lower);
    const auto pixel_of = [](const Float8& at) { return __builtin_convertvector(at, Int8) / grid; };
    const Int8 x_first = pixel_of(left), x_last = pixel_of(right), y_first = pixel_of(upper), y_last = pixel_of(lower);
    const Int8 across = x_last - x_first, down = y_last - y_first;
    const Int8 wide = across > down ? across : down, around = (wide > 0 ? wide + 1 : Int8{}) / 2;
    const Int8 inside = around < dilations;
    const Int8 there = (around * side + (y_first + y_last) / 2) * side + (x_first + x_last) / 2;
    store(covering + i, inside ? there : Int8{} + never_full);
  }

  /// Of eight, those that may cover samples that are not full of what is nearer.
  uint32_t to_draw(int i, const float* farthest) const {
    Int8 shows;
    Float8 full;
    __builtin_memcpy(&shows, may_show + i, sizeof(shows));
    for (int l = 0; l < width; ++l) full[l] = farthest[covering[i + l]];
    const Int8 covers = (load(x0 + i) <= load(x1 + i)) & (load(y0 + i) <= load(y1 + i));
    return bits_of(shows & covers & (full >= load(nearest + i)));
  }
};

void SplatTile::start(const V2i& corner, const V2f& jitter, uint32_t round) {
  corner_ = corner, jitter_ = jitter, round_ = round;
  std::fill(std::begin(depth_), std::end(depth_), infinity);
  std::fill(std::begin(drawn_), std::end(drawn_), none);
  for (auto& of_pixels : farthest_) std::fill(std::begin(of_pixels), std::end(of_pixels), infinity);
  farthest_in_tile_ = infinity;
  since_found_ = 0;
  records_.clear();
}

bool SplatTile::hides(const V2i& min, const V2i& max, float depth) const {
  for (int y = min.y; y <= max.y; ++y)
    for (int x = min.x; x <= max.x; ++x)
      if (!(farthest_[0][y * side + x] < depth)) return false;
  return true;
}

void SplatTile::find_farthest() {
  for (int y = 0; y < side; ++y) {
    float column[samples];
    const float* const from = depth_ + y * grid * samples;
#pragma GCC ivdep
    for (int x = 0; x < samples; ++x)
      column[x] = larger(larger(from[x], from[x + samples]), larger(from[x + 2 * samples], from[x + 3 * samples]));
    for (int x = 0; x < side; ++x)
      farthest_[0][y * side + x] =
          larger(larger(column[x * grid], column[x * grid + 1]), larger(column[x * grid + 2], column[x * grid + 3]));
  }
  for (int d = 1; d < dilations; ++d) {
    const float* const from = farthest_[d - 1];
    float along[side * side];
    for (int y = 0; y < side; ++y) {
      const float* const row = from + y * side;
      along[y * side] = larger(row[0], row[1]), along[y * side + side - 1] = larger(row[side - 2], row[side - 1]);
#pragma GCC ivdep
      for (int x = 1; x < side - 1; ++x) along[y * side + x] = larger(larger(row[x - 1], row[x]), row[x + 1]);
    }
    for (int y = 0; y < side; ++y) {
      const float *const row = along + y * side, *const above = y > 0 ? row - side : row,
                         *const below = y + 1 < side ? row + side : row;
#pragma GCC ivdep
      for (int x = 0; x < side; ++x) farthest_[d][y * side + x] = larger(larger(above[x], row[x]), below[x]);
    }
  }
  farthest_in_tile_ = *std::max_element(std::begin(farthest_[0]), std::end(farthest_[0]));
}

// A fragment has one record in a pixel.
void SplatTile::put(const V2i& at, const Record& shown, float depth) {
  const size_t recent = std::min<size_t>(records_.size(), SampleMask::count);
  const auto known = std::find(records_.end() - std::ptrdiff_t(recent), records_.end(), shown);
  const auto place = size_t(at.y * samples + at.x);
  depth_[place] = depth;
  drawn_[place] = uint32_t(known - records_.begin());
  if (known == records_.end()) records_.push_back(shown);
}

void SplatTile::prefetch(const Draw& draw, uint32_t chunk) {
  const SplatLevel& level = draw.object->levels[size_t(draw.level)];
  __builtin_prefetch(&level.chunks[chunk].count);
  const auto* const from = reinterpret_cast<const char*>(&level.lanes[chunk]);
  for (size_t line = 0; line < 3 * sizeof(SplatLevel::Lanes::x); line += 64) __builtin_prefetch(from + line);
}

// Which of eight chunks reach into the tile and are not behind what it is full of, by their spheres.
uint32_t SplatTile::may_show(const Draw& draw, const SplatLevel::Spheres& spheres) const {
  const auto& m = draw.map.m;
  const float texel = draw.object->levels[size_t(draw.level)].texel;
  const auto length_of = [&](int r) { return std::sqrt(sqr(m[r][0]) + sqr(m[r][1]) + sqr(m[r][2])); };
  const Float8 px = load(spheres.x), py = load(spheres.y), pz = load(spheres.z);
  const float steep = draw.object->one_sided ? SplatObject::steepest : SplatObject::steepest_owned;
  // With what fragments reach beyond their texels' middles.
  const Float8 across = load(spheres.radius) + texel, along = load(spheres.radius) + 1.2f * texel * (1 + steep);
  const auto row = [&](int r) { return m[r][0] * px + m[r][1] * py + m[r][2] * pz + m[r][3]; };
  const Float8 W = row(ScreenMap::W), nearest_W = W - across * length_of(ScreenMap::W), zero{};
  const Float8 x = (row(ScreenMap::X) / W - float(corner_.x)) - jitter_.x / float(grid),
               y = (row(ScreenMap::Y) / W - float(corner_.y)) - jitter_.y / float(grid);
  const Float8 reach = draw.reach * across / nearest_W, end = zero + float(side);
  const Float8 depth = row(ScreenMap::Z) - along * length_of(ScreenMap::Z);
  const Int8 reaches =
      (nearest_W <= 0) | ((x + reach >= 0) & (y + reach >= 0) & (x - reach <= end) & (y - reach <= end));
  uint32_t out = 0;
  for (int i = 0; i < width; ++i) {
    if (!reaches[i]) continue;
    float farthest = farthest_in_tile_;
    if (nearest_W[i] > 0 && reach[i] < float(dilations - 1)) {
      const auto pixel = [](float at) { return int(std::clamp(at, 0.0f, float(side - 1))); };
      farthest = farthest_[int(std::ceil(reach[i]))][pixel(y[i]) * side + pixel(x[i])];
    }
    if (!(farthest < depth[i])) out |= 1u << i;
  }
  return out;
}

void SplatTile::splat_all(const Draw& draw, uint32_t draw_index) {
  const SplatLevel& level = draw.object->levels[size_t(draw.level)];
  constexpr uint32_t group = SplatLevel::Spheres::count;
  for (uint32_t g = 0; g < level.spheres.size(); ++g) {
    const uint32_t shown = may_show(draw, level.spheres[g]);
    for (uint32_t i = 0; i < group && g * group + i < level.chunks.size(); ++i)
      if (shown >> i & 1) splat(draw, draw_index, g * group + i);
  }
}

void SplatTile::splat(const Draw& draw, uint32_t draw_index, uint32_t chunk_index) {
  if (++since_found_ > chunks_between) find_farthest(), since_found_ = 0;
  const SplatLevel& level = draw.object->levels[size_t(draw.level)];
  const SplatLevel::Chunk& chunk = level.chunks[chunk_index];
  Projection p;
  p.from = &level.lanes[chunk_index];
  const float dx = -float(corner_.x * grid) - jitter_.x, dy = -float(corner_.y * grid) - jitter_.y;
  p.place(draw.map, level.texel, draw.object->frames[chunk.view]);
  const float reach_scale = draw.reach * float(grid) * level.texel;
  p.find_near(dx, dy, reach_scale);
  const float steep = draw.object->one_sided ? SplatObject::steepest : SplatObject::steepest_owned;
  const auto deep = [&](const float* axis) { return std::abs(axis[3]) + steep * std::abs(p.n[3]); };
  const float pixels = std::ceil(reach_scale * p.most_inverse_w() / float(grid));
  if (pixels < float(dilations)) p.hide_behind(farthest_[int(pixels)], 0.55f * (deep(p.u) + deep(p.v)));
  const bool whole = draw.samples == LevelChoice::all_samples && draw.ray_share == 0;
  for (int begin = 0; begin < int(chunk.count); begin += width) {
    Int8 shows;
    __builtin_memcpy(&shows, p.may_show + begin, sizeof(shows));
    if (!any(shows)) continue;
    p.find_sides(begin);
    uint32_t left = p.to_draw(begin, &farthest_[0][0]);
    if (begin + width > int(chunk.count)) left &= (1u << (int(chunk.count) - begin)) - 1;
    for (; left != 0; left &= left - 1) {
      const int k = begin + std::countr_zero(left);
      const Record shown{draw_index, chunk.view, chunk_index * uint32_t(lanes) + uint32_t(k)};
      whole ? splat_fragment<true>(draw, p, k, shown) : splat_fragment<false>(draw, p, k, shown);
    }
  }
}

template <bool whole>
void SplatTile::splat_fragment(const Draw& draw, const Projection& p, int lane, const Record& shown) {
  const SplatLevel::Lanes& from = *p.from;
  constexpr float unit = 0.01f * grid, middle = 0.5f * grid;
  const Float8 zero{}, step{0, 1, 2, 3, 4, 5, 6, 7};
  const Int8 number{0, 1, 2, 3, 4, 5, 6, 7}, nought{}, last = nought + (grid - 1);
  const Int8 mask = nought + int(from.mask[lane]);
  const float a0 = unit * float(from.left[lane]), a1 = unit * float(from.right[lane]),
              b0 = unit * float(from.bottom[lane]), b1 = unit * float(from.top[lane]);
  const float a_x = p.a_x[lane], a_y = p.a_y[lane], b_x = p.b_x[lane], b_y = p.b_y[lane];
  const int first_column = int(p.x0[lane]), last_column = int(p.x1[lane]), last_row = int(p.y1[lane]);
  const auto record = int32_t(records_.size());
  Int8 drawn{};
  const auto pixel_groups = [&](const Int8& x, int y) {  // ray_group()
    const int of_row = ray_group(corner_ + V2i(0, y), round_);
    return (x + of_row) & (LevelChoice::ray_steps - 1);
  };
  for (int row = int(p.y0[lane]); row <= last_row; ++row) {
    const float dy = float(row) - p.y[lane];
    for (int column = first_column; column <= last_column; column += width) {
      const Float8 dx = step + (float(column) - p.x[lane]);
      const Float8 a = a_x * dx + a_y * dy, b = b_x * dx + b_y * dy;
      const Float8 z_there = p.depth[lane] + a * p.z_a[lane] + b * p.z_b[lane];
      const Float8 z = z_there > 1e-30f ? z_there : zero + 1e-30f;
      float* const depths = depth_ + row * samples + column;
      const Float8 before = load(depths);
      Int8 i = __builtin_convertvector(a + middle, Int8), j = __builtin_convertvector(b + middle, Int8);
      i = i > last ? last : i < nought ? nought : i;
      j = j > last ? last : j < nought ? nought : j;
      const Int8 covered = -(mask >> (j * grid + i) & 1);
      Int8 takes =
          (a >= a0) & (a < a1) & (b >= b0) & (b < b1) & covered & (z < before) & (number <= last_column - column);
      if (!whole) {
        const Int8 at = number + column;
        takes &= -((nought + (draw.samples >> (row % grid * grid) & 15)) >> (at % grid) & 1);
        takes &= pixel_groups(at / grid, row / grid) >= draw.ray_share;
      }
      const Float8 after = takes ? z : before;
      __builtin_memcpy(depths, &after, sizeof(after));
      uint32_t* const records = drawn_ + row * samples + column;
      Int8 there;
      __builtin_memcpy(&there, records, sizeof(there));
      there = takes ? nought + record : there;
      __builtin_memcpy(records, &there, sizeof(there));
      drawn |= takes;
    }
  }
  if (any(drawn)) records_.push_back(shown);
}

}  // namespace dapple::depthimage
