// SPDX-License-Identifier: Apache-2.0
#include "dapple/depthimage/splat_tile.h"

#include <algorithm>

#include "dapple/depthimage/image_numbers.h"

namespace dapple::depthimage {

namespace {

constexpr int grid = SampleMask::side;
constexpr int lanes = SplatLevel::chunk_size;

// First and last set bit of four, by the bits.
constexpr uint8_t first_bit[16] = {4, 0, 1, 0, 2, 0, 1, 0, 3, 0, 1, 0, 2, 0, 1, 0};
constexpr uint8_t end_bit[16] = {0, 1, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4};

/// The rectangle of a mask's samples, in texels from the texel's middle. Where all samples at a border are covered, the
/// surface goes on beyond.
struct MaskBox {
  float a0, a1, b0, b1;
  explicit MaskBox(unsigned mask) {
    const unsigned columns = (mask | mask >> 4 | mask >> 8 | mask >> 12) & 15u;
    const unsigned rows = unsigned((mask & 15u) != 0) | unsigned((mask & 0xf0u) != 0) << 1 |
                          unsigned((mask & 0xf00u) != 0) << 2 | unsigned((mask & 0xf000u) != 0) << 3;
    constexpr float step = 1.0f / grid;
    const auto more = [mask](unsigned border) { return (mask & border) == border ? ImageNumbers::overlap : 0.0f; };
    a0 = float(first_bit[columns]) * step - 0.5f - more(0x1111);
    a1 = float(end_bit[columns]) * step - 0.5f + more(0x8888);
    b0 = float(first_bit[rows]) * step - 0.5f - more(0xf);
    b1 = float(end_bit[rows]) * step - 0.5f + more(0xf000);
  }
};

}  // namespace

/// A chunk on the film, in sub-samples from the tile's corner, and what a texel's axes do to it.
struct SplatTile::Projection {
  float x[lanes], y[lanes], w[lanes], depth[lanes];
  float u[4], v[4], n[4];  // rows of ScreenMap of the frame's axes times a texel

  Projection(const Draw& draw, const SplatLevel& level, const SplatLevel::Chunk& chunk, const V2i& corner,
             const V2f& jitter) {
    const ScreenMap& m = draw.map;
    const float dx = -float(corner.x * grid) - jitter.x, dy = -float(corner.y * grid) - jitter.y;
    const float *px = &level.x[chunk.first], *py = &level.y[chunk.first], *pz = &level.z[chunk.first];
    for (int i = 0; i < lanes; ++i) {
      const float W = m.m[2][0] * px[i] + m.m[2][1] * py[i] + m.m[2][2] * pz[i] + m.m[2][3];
      const float scale = float(grid) / W;
      x[i] = (m.m[0][0] * px[i] + m.m[0][1] * py[i] + m.m[0][2] * pz[i] + m.m[0][3]) * scale + dx;
      y[i] = (m.m[1][0] * px[i] + m.m[1][1] * py[i] + m.m[1][2] * pz[i] + m.m[1][3]) * scale + dy;
      depth[i] = m.m[3][0] * px[i] + m.m[3][1] * py[i] + m.m[3][2] * pz[i] + m.m[3][3];
      w[i] = W;
    }
    const ViewFrame& frame = draw.object->frames[chunk.view];
    for (int r = 0; r < 4; ++r) {
      u[r] = m.apply_vector(ScreenMap::Row(r), frame.u) * level.texel;
      v[r] = m.apply_vector(ScreenMap::Row(r), frame.v) * level.texel;
      n[r] = m.apply_vector(ScreenMap::Row(r), frame.w) * level.texel;
    }
  }
};

void SplatTile::start(const V2i& corner, const V2f& jitter, uint32_t round) {
  corner_ = corner, jitter_ = jitter, round_ = round;
  std::fill(std::begin(keys_), std::end(keys_), empty);
  records_.clear();
}

void SplatTile::splat(const Draw& draw, uint32_t draw_index, const SplatLevel::Chunk& chunk) {
  const SplatLevel& level = draw.object->levels[size_t(draw.level)];
  const Projection p(draw, level, chunk, corner_, jitter_);
  for (uint32_t i = 0; i < chunk.count; ++i) {
    const uint32_t f = chunk.first + i;
    splat_fragment(draw, p, int(i), draw_index, chunk.view, f, level.mask[f],
                   V2f(level.slope_u[f], level.slope_v[f]));
  }
}

void SplatTile::splat_fragment(const Draw& draw, const Projection& p, int lane, uint32_t draw_index, uint32_t view,
                               uint32_t fragment, uint16_t mask, V2f slope) {
  const float inverse_w = 1 / p.w[lane];
  if (!(p.w[lane] > 0) || !(p.depth[lane] > 0)) return;
  const float x = p.x[lane], y = p.y[lane];
  // Sides of the texel's parallelogram: how the film moves where the plane does.
  const float film_x = (x + float(corner_.x * grid) + jitter_.x) * (1.0f / grid),
              film_y = (y + float(corner_.y * grid) + jitter_.y) * (1.0f / grid);
  const auto sweep = [&](const float* axis, float along, float film, int row) {
    const float change = axis[row] + along * p.n[row], change_w = axis[2] + along * p.n[2];
    return (change - film * change_w) * inverse_w * float(grid);
  };
  const float xu = sweep(p.u, slope.x, film_x, 0), yu = sweep(p.u, slope.x, film_y, 1);
  const float xv = sweep(p.v, slope.y, film_x, 0), yv = sweep(p.v, slope.y, film_y, 1);
  const MaskBox box(mask);
  const float x0 = x + std::min(xu * box.a0, xu * box.a1) + std::min(xv * box.b0, xv * box.b1),
              x1 = x + std::max(xu * box.a0, xu * box.a1) + std::max(xv * box.b0, xv * box.b1),
              y0 = y + std::min(yu * box.a0, yu * box.a1) + std::min(yv * box.b0, yv * box.b1),
              y1 = y + std::max(yu * box.a0, yu * box.a1) + std::max(yv * box.b0, yv * box.b1);
  if (!(x1 >= 0 && y1 >= 0 && x0 < float(samples) && y0 < float(samples))) return;
  const int first_column = int(std::ceil(std::max(x0, 0.0f))), first_row = int(std::ceil(std::max(y0, 0.0f)));
  const int end_column = int(std::min(x1, float(samples - 1))) + 1, end_row = int(std::min(y1, float(samples - 1))) + 1;
  const float area = xu * yv - xv * yu;
  if (!(std::abs(area) > 1e-12f)) return;
  const float a_x = yv / area * grid, a_y = -xv / area * grid, b_x = -yu / area * grid, b_y = xu / area * grid;
  const float z_u = p.u[3] + slope.x * p.n[3], z_v = p.v[3] + slope.y * p.n[3];
  const float z_a = z_u / grid, z_b = z_v / grid, middle = 0.5f * grid;
  const float a0 = box.a0 * grid, a1 = box.a1 * grid, b0 = box.b0 * grid, b1 = box.b1 * grid;
  uint32_t record = none;
  for (int row = first_row; row < end_row; ++row)
    for (int column = first_column; column < end_column; ++column) {
      const float dx = float(column) - x, dy = float(row) - y;
      const float a = a_x * dx + a_y * dy, b = b_x * dx + b_y * dy;
      if (!(a >= a0 && a < a1 && b >= b0 && b < b1)) continue;
      const int sample_i = std::clamp(int(a + middle), 0, grid - 1),
                sample_j = std::clamp(int(b + middle), 0, grid - 1);
      if (!(mask >> (sample_j * grid + sample_i) & 1)) continue;
      const int sub = row % grid * grid + column % grid;
      if (!(draw.samples >> sub & 1)) continue;
      if (draw.ray_share > 0 &&
          ray_group(corner_ + V2i(column / grid, row / grid), round_) < draw.ray_share)
        continue;
      const float z = std::max(p.depth[lane] + a * z_a + b * z_b, 1e-30f);
      uint64_t& key = keys_[size_t(row * samples + column)];
      const uint64_t depth = uint64_t(std::bit_cast<uint32_t>(z)) << 32;
      if (depth >= (key & ~uint64_t(0xffffffff))) continue;
      if (record == none) {
        record = uint32_t(records_.size());
        records_.push_back({draw_index, view, fragment});
      }
      key = depth | record;
    }
}

}  // namespace dapple::depthimage
