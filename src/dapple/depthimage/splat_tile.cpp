// SPDX-License-Identifier: Apache-2.0
#include "dapple/depthimage/splat_tile.h"

#include <algorithm>

namespace dapple::depthimage {

namespace {

constexpr int grid = SampleMask::side;
constexpr int lanes = SplatLevel::chunk_size;

}  // namespace

/// Those fragments of a chunk that may show in the tile, structure of arrays: where, in sub-samples, each lies, and how
/// to get from there to its texel.
struct SplatTile::Projection {
  int count = 0;
  uint8_t lane[lanes];
  uint16_t mask[lanes];
  alignas(32) float film_x[lanes], film_y[lanes], inverse_w[lanes], depth[lanes];
  alignas(32) float slope_u[lanes], slope_v[lanes], left[lanes], right[lanes], bottom[lanes], top[lanes];
  alignas(32) float x[lanes], y[lanes], reach[lanes];
  alignas(32) int32_t is_near[lanes];
  alignas(32) float x0[lanes], x1[lanes], y0[lanes], y1[lanes];      // all that it may cover
  alignas(32) float a_x[lanes], a_y[lanes], b_x[lanes], b_y[lanes];  // samples of the texel by sub-samples of the film
  alignas(32) float z_a[lanes], z_b[lanes];                          // depth by samples
  float u[4], v[4], n[4];  // rows of the map, of the frame's axes, a texel long

  void place(const ScreenMap& map, float texel, const SplatLevel::Lanes& from, const ViewFrame& frame) {
    for (int r = 0; r < 4; ++r) {
      u[r] = map.apply_vector(ScreenMap::Row(r), frame.u) * texel;
      v[r] = map.apply_vector(ScreenMap::Row(r), frame.v) * texel;
      n[r] = map.apply_vector(ScreenMap::Row(r), frame.w) * texel;
    }
    const auto& m = map.m;
    const float *px = from.x, *py = from.y, *pz = from.z;
#pragma GCC ivdep
    for (int i = 0; i < lanes; ++i) {
      inverse_w[i] = 1 / (m[2][0] * px[i] + m[2][1] * py[i] + m[2][2] * pz[i] + m[2][3]);
      film_x[i] = (m[0][0] * px[i] + m[0][1] * py[i] + m[0][2] * pz[i] + m[0][3]) * inverse_w[i];
      film_y[i] = (m[1][0] * px[i] + m[1][1] * py[i] + m[1][2] * pz[i] + m[1][3]) * inverse_w[i];
      depth[i] = m[3][0] * px[i] + m[3][1] * py[i] + m[3][2] * pz[i] + m[3][3];
    }
  }

  /// Which may show in the tile.
  void find_near(float dx, float dy, float reach_scale) {
    constexpr float end = float(samples - 1);
#pragma GCC ivdep
    for (int i = 0; i < lanes; ++i) {
      x[i] = film_x[i] * float(grid) + dx, y[i] = film_y[i] * float(grid) + dy;
      const float r = reach_scale * inverse_w[i];
      reach[i] = r;
      is_near[i] =
          int(inverse_w[i] > 0) & int(x[i] >= -r) & int(y[i] >= -r) & int(x[i] <= end + r) & int(y[i] <= end + r);
    }
  }

  void keep(int i, const SplatLevel::Lanes& from) {
    const int k = count++;
    lane[k] = uint8_t(i), mask[k] = from.mask[i];
    film_x[k] = film_x[i], film_y[k] = film_y[i], inverse_w[k] = inverse_w[i], depth[k] = depth[i];
    slope_u[k] = from.slope_u[i], slope_v[k] = from.slope_v[i];
    left[k] = from.left[i], right[k] = from.right[i], bottom[k] = from.bottom[i], top[k] = from.top[i];
  }

  void find_sides(float dx, float dy) {
    const auto least = [](float p, float q) { return p < q ? p : q; };
    const auto most = [](float p, float q) { return p > q ? p : q; };
    const int padded = (count + 7) / 8 * 8;
#pragma GCC ivdep
    for (int i = 0; i < padded; ++i) {
      const float scale = float(grid) * inverse_w[i];
      // Sides of the texel's parallelogram: how the film moves where the plane does.
      const float wu = u[2] + slope_u[i] * n[2], wv = v[2] + slope_v[i] * n[2];
      const float xu = (u[0] + slope_u[i] * n[0] - film_x[i] * wu) * scale,
                  yu = (u[1] + slope_u[i] * n[1] - film_y[i] * wu) * scale,
                  xv = (v[0] + slope_v[i] * n[0] - film_x[i] * wv) * scale,
                  yv = (v[1] + slope_v[i] * n[1] - film_y[i] * wv) * scale;
      const float inverse_area = float(grid) / (xu * yv - xv * yu);
      x[i] = film_x[i] * float(grid) + dx;
      y[i] = film_y[i] * float(grid) + dy;
      a_x[i] = yv * inverse_area, a_y[i] = -xv * inverse_area;
      b_x[i] = -yu * inverse_area, b_y[i] = xu * inverse_area;
      z_a[i] = (u[3] + slope_u[i] * n[3]) / float(grid), z_b[i] = (v[3] + slope_v[i] * n[3]) / float(grid);
      const float p = 0.01f * left[i], q = 0.01f * right[i], r = 0.01f * bottom[i], s = 0.01f * top[i];
      x0[i] = most(std::ceil(x[i] + least(xu * p, xu * q) + least(xv * r, xv * s)), 0.0f);
      x1[i] = least(std::floor(x[i] + most(xu * p, xu * q) + most(xv * r, xv * s)), float(samples - 1));
      y0[i] = most(std::ceil(y[i] + least(yu * p, yu * q) + least(yv * r, yv * s)), 0.0f);
      y1[i] = least(std::floor(y[i] + most(yu * p, yu * q) + most(yv * r, yv * s)), float(samples - 1));
    }
  }
};

void SplatTile::start(const V2i& corner, const V2f& jitter, uint32_t round) {
  corner_ = corner, jitter_ = jitter, round_ = round;
  std::fill(std::begin(keys_), std::end(keys_), empty);
  std::fill(std::begin(filled_), std::end(filled_), uint8_t(0));
  std::fill(std::begin(farthest_), std::end(farthest_), infinity);
  records_.clear();
}

bool SplatTile::hides(const V2i& min, const V2i& max, float depth) const {
  for (int y = min.y; y <= max.y; ++y)
    for (int x = min.x; x <= max.x; ++x)
      if (!(farthest_[y * side + x] < depth)) return false;
  return true;
}

void SplatTile::put(int column, int row, uint64_t key) {
  uint64_t& place = keys_[row * samples + column];
  const int pixel = row / grid * side + column / grid;
  const bool full = filled_[pixel] == SampleMask::count || (place == empty && ++filled_[pixel] == SampleMask::count);
  place = key;
  if (!full) return;
  uint64_t most = 0;
  const uint64_t* const first = keys_ + row / grid * grid * samples + column / grid * grid;
  for (int y = 0; y < grid; ++y)
    for (int x = 0; x < grid; ++x) most = std::max(most, first[y * samples + x]);
  farthest_[pixel] = std::bit_cast<float>(uint32_t(most >> 32));
}

void SplatTile::prefetch(const Draw& draw, uint32_t chunk) {
  const SplatLevel& level = draw.object->levels[size_t(draw.level)];
  __builtin_prefetch(&level.chunks[chunk].count);
  const auto* const from = reinterpret_cast<const char*>(&level.lanes[chunk]);
  for (size_t line = 0; line < 3 * sizeof(SplatLevel::Lanes::x); line += 64) __builtin_prefetch(from + line);
}

void SplatTile::splat(const Draw& draw, uint32_t draw_index, uint32_t chunk_index) {
  const SplatLevel& level = draw.object->levels[size_t(draw.level)];
  const SplatLevel::Chunk& chunk = level.chunks[chunk_index];
  const SplatLevel::Lanes& from = level.lanes[chunk_index];
  Projection p;
  const float dx = -float(corner_.x * grid) - jitter_.x, dy = -float(corner_.y * grid) - jitter_.y;
  p.place(draw.map, level.texel, from, draw.object->frames[chunk.view]);
  p.find_near(dx, dy, draw.reach * float(grid) * level.texel);
  const float steep = draw.object->one_sided ? SplatObject::steepest : SplatObject::steepest_owned;
  const auto deep = [&](const float* axis) { return std::abs(axis[3]) + steep * std::abs(p.n[3]); };
  const float depth_reach = 0.55f * (deep(p.u) + deep(p.v));
  for (uint32_t i = 0; i < chunk.count; ++i) {
    if (!p.is_near[i]) continue;
    const auto pixel = [](float at) { return int(std::clamp(at, 0.0f, float(samples - 1))) / grid; };
    const float x = p.x[i], y = p.y[i], reach = p.reach[i];
    if (hides(V2i(pixel(x - reach), pixel(y - reach)), V2i(pixel(x + reach), pixel(y + reach)),
              p.depth[i] - depth_reach))
      continue;
    p.keep(int(i), from);
  }
  if (p.count == 0) return;
  p.find_sides(dx, dy);
  const bool whole = draw.samples == LevelChoice::all_samples && draw.ray_share == 0;
  for (int k = 0; k < p.count; ++k) {
    if (!(p.x0[k] <= p.x1[k] && p.y0[k] <= p.y1[k])) continue;
    const Record shown{draw_index, chunk.view, chunk_index * uint32_t(lanes) + p.lane[k]};
    whole ? splat_fragment<true>(draw, p, k, shown) : splat_fragment<false>(draw, p, k, shown);
  }
}

template <bool whole>
void SplatTile::splat_fragment(const Draw& draw, const Projection& p, int lane, const Record& shown) {
  const unsigned mask = p.mask[lane];
  constexpr float unit = 0.01f * grid, middle = 0.5f * grid;
  const float a0 = unit * p.left[lane], a1 = unit * p.right[lane], b0 = unit * p.bottom[lane], b1 = unit * p.top[lane];
  const float x = p.x[lane], y = p.y[lane], depth_here = p.depth[lane];
  const float a_x = p.a_x[lane], a_y = p.a_y[lane], b_x = p.b_x[lane], b_y = p.b_y[lane];
  const float z_a = p.z_a[lane], z_b = p.z_b[lane];
  const int first_column = int(p.x0[lane]), last_column = int(p.x1[lane]), last_row = int(p.y1[lane]);
  uint32_t record = none;
  for (int row = int(p.y0[lane]); row <= last_row; ++row)
    for (int column = first_column; column <= last_column; ++column) {
      if (!whole && !(draw.samples >> (row % grid * grid + column % grid) & 1)) continue;
      const float dx = float(column) - x, dy = float(row) - y;
      const float a = a_x * dx + a_y * dy, b = b_x * dx + b_y * dy;
      if (!(a >= a0 && a < a1 && b >= b0 && b < b1)) continue;
      const int i = std::clamp(int(a + middle), 0, grid - 1), j = std::clamp(int(b + middle), 0, grid - 1);
      if (!(mask >> (j * grid + i) & 1)) continue;
      if (!whole && draw.ray_share > 0 && ray_group(corner_ + V2i(column / grid, row / grid), round_) < draw.ray_share)
        continue;
      const float z = std::max(depth_here + a * z_a + b * z_b, 1e-30f);
      const uint64_t depth = uint64_t(std::bit_cast<uint32_t>(z)) << 32;
      if (depth >= (keys_[row * samples + column] & ~uint64_t(0xffffffff))) continue;
      if (record == none) {
        record = uint32_t(records_.size());
        records_.push_back(shown);
      }
      put(column, row, depth | record);
    }
}

}  // namespace dapple::depthimage
