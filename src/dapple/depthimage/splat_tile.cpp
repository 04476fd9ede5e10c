// SPDX-License-Identifier: Apache-2.0
#include "dapple/depthimage/splat_tile.h"

#include <algorithm>

namespace dapple::depthimage {

namespace {

constexpr int grid = SampleMask::side;
constexpr int lanes = SplatLevel::chunk_size;

}  // namespace

/// A chunk on the film, structure of arrays: where in the tile, in sub-samples, each fragment lies, and how to get from
/// there to its texel.
struct SplatTile::Projection {
  alignas(32) float x[lanes], y[lanes], depth[lanes];
  alignas(32) float x0[lanes], x1[lanes], y0[lanes], y1[lanes];      // all that it may cover
  alignas(32) float a_x[lanes], a_y[lanes], b_x[lanes], b_y[lanes];  // samples of the texel by sub-samples of the film
  alignas(32) float z_a[lanes], z_b[lanes];                          // depth by samples

  Projection(const Draw& draw, const SplatLevel& level, const SplatLevel::Chunk& chunk, const V2i& corner,
             const V2f& jitter) {
    const auto& m = draw.map.m;
    const ViewFrame& frame = draw.object->frames[chunk.view];
    float u[4], v[4], n[4];  // of the frame's axes, a texel long
    for (int r = 0; r < 4; ++r) {
      u[r] = draw.map.apply_vector(ScreenMap::Row(r), frame.u) * level.texel;
      v[r] = draw.map.apply_vector(ScreenMap::Row(r), frame.v) * level.texel;
      n[r] = draw.map.apply_vector(ScreenMap::Row(r), frame.w) * level.texel;
    }
    const float dx = -float(corner.x * grid) - jitter.x, dy = -float(corner.y * grid) - jitter.y;
    const float *px = &level.x[chunk.first], *py = &level.y[chunk.first], *pz = &level.z[chunk.first];
    const float *slope_u = &level.slope_u[chunk.first], *slope_v = &level.slope_v[chunk.first];
    const int8_t *left = &level.left[chunk.first], *right = &level.right[chunk.first],
                 *bottom = &level.bottom[chunk.first], *top = &level.top[chunk.first];
    for (int i = 0; i < lanes; ++i) {
      const float inverse_w = 1 / (m[2][0] * px[i] + m[2][1] * py[i] + m[2][2] * pz[i] + m[2][3]);
      const float film_x = (m[0][0] * px[i] + m[0][1] * py[i] + m[0][2] * pz[i] + m[0][3]) * inverse_w;
      const float film_y = (m[1][0] * px[i] + m[1][1] * py[i] + m[1][2] * pz[i] + m[1][3]) * inverse_w;
      const float scale = float(grid) * inverse_w;
      // Sides of the texel's parallelogram: how the film moves where the plane does.
      const float wu = u[2] + slope_u[i] * n[2], wv = v[2] + slope_v[i] * n[2];
      const float xu = (u[0] + slope_u[i] * n[0] - film_x * wu) * scale,
                  yu = (u[1] + slope_u[i] * n[1] - film_y * wu) * scale,
                  xv = (v[0] + slope_v[i] * n[0] - film_x * wv) * scale,
                  yv = (v[1] + slope_v[i] * n[1] - film_y * wv) * scale;
      const float inverse_area = float(grid) / (xu * yv - xv * yu);
      x[i] = film_x * float(grid) + dx;
      y[i] = film_y * float(grid) + dy;
      depth[i] = m[3][0] * px[i] + m[3][1] * py[i] + m[3][2] * pz[i] + m[3][3];
      a_x[i] = yv * inverse_area, a_y[i] = -xv * inverse_area;
      b_x[i] = -yu * inverse_area, b_y[i] = xu * inverse_area;
      z_a[i] = (u[3] + slope_u[i] * n[3]) / float(grid), z_b[i] = (v[3] + slope_v[i] * n[3]) / float(grid);
      const float a0 = 0.01f * float(left[i]), a1 = 0.01f * float(right[i]), b0 = 0.01f * float(bottom[i]),
                  b1 = 0.01f * float(top[i]);
      const auto least = [](float p, float q) { return p < q ? p : q; };
      const auto most = [](float p, float q) { return p > q ? p : q; };
      x0[i] = x[i] + least(xu * a0, xu * a1) + least(xv * b0, xv * b1);
      x1[i] = x[i] + most(xu * a0, xu * a1) + most(xv * b0, xv * b1);
      y0[i] = y[i] + least(yu * a0, yu * a1) + least(yv * b0, yv * b1);
      y1[i] = y[i] + most(yu * a0, yu * a1) + most(yv * b0, yv * b1);
      // Sub-samples that it covers are whole numbers between; and it lies before the camera.
      x0[i] = inverse_w > 0 ? most(std::ceil(x0[i]), 0.0f) : float(samples);
      y0[i] = most(std::ceil(y0[i]), 0.0f);
      x1[i] = least(std::floor(x1[i]), float(samples - 1));
      y1[i] = least(std::floor(y1[i]), float(samples - 1));
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

bool SplatTile::hides(const Projection& p, int lane) const {
  const float nearest = p.depth[lane] - (std::abs(p.z_a[lane]) + std::abs(p.z_b[lane])) * (0.55f * grid);
  return hides(V2i(int(p.x0[lane]) / grid, int(p.y0[lane]) / grid), V2i(int(p.x1[lane]) / grid, int(p.y1[lane]) / grid),
               nearest);
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

void SplatTile::splat(const Draw& draw, uint32_t draw_index, const SplatLevel::Chunk& chunk) {
  const SplatLevel& level = draw.object->levels[size_t(draw.level)];
  const Projection p(draw, level, chunk, corner_, jitter_);
  const bool whole = draw.samples == LevelChoice::all_samples && draw.ray_share == 0;
  for (uint32_t i = 0; i < chunk.count; ++i)
    if (p.x0[i] <= p.x1[i] && p.y0[i] <= p.y1[i] && !hides(p, int(i)))
      whole ? splat_fragment<true>(draw, level, p, int(i), {draw_index, chunk.view, chunk.first + i})
            : splat_fragment<false>(draw, level, p, int(i), {draw_index, chunk.view, chunk.first + i});
}

template <bool whole>
void SplatTile::splat_fragment(const Draw& draw, const SplatLevel& level, const Projection& p, int lane,
                               const Record& shown) {
  const uint32_t f = shown.fragment;
  const unsigned mask = level.mask[f];
  constexpr float unit = 0.01f * grid, middle = 0.5f * grid;
  const float a0 = unit * float(level.left[f]), a1 = unit * float(level.right[f]), b0 = unit * float(level.bottom[f]),
              b1 = unit * float(level.top[f]);
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
      if (!whole && draw.ray_share > 0 &&
          ray_group(corner_ + V2i(column / grid, row / grid), round_) < draw.ray_share)
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
