// SPDX-License-Identifier: Apache-2.0
#include "dapple/glimpostor/draw_uniforms.h"

#include <bit>

namespace dapple::glimpostor {

using depthimage::SampleMask;
using depthimage::ScreenMap;
using depthimage::SplatTile;

void set_draws(Draws draws, const DrawList& list, BufferTexture* to) {
  std::vector<float> rows;
  rows.reserve(list.draws.size() * 20);
  for (const uint32_t number : list.draws) {
    const SplatTile::Draw& draw = draws[number];
    for (const auto& row : draw.map.m) rows.insert(rows.end(), row, row + 4);
    const uint32_t limits = uint32_t(draw.samples) | uint32_t(draw.ray_share) << 16;
    rows.insert(rows.end(), {std::bit_cast<float>(number), std::bit_cast<float>(limits), 0, 0});
  }
  to->set(GL_RGBA32F, rows.data(), rows.size() * sizeof(float), 4 * sizeof(float));
}

void set_region(const Program& program, const Region& region) {
  const V2i size = region.pixels.max - region.pixels.min;
  // A sub-sample's place is where OpenGL has the middle of its square.
  const float shift_x = (region.jitter.x - 0.5f) / float(SampleMask::side),
              shift_y = (region.jitter.y - 0.5f) / float(SampleMask::side);
  glUniform4f(program.at("region"), float(region.pixels.min.x) + shift_x, float(region.pixels.min.y) + shift_y,
              2 / float(size.x), 2 / float(size.y));
  glUniform2i(program.at("corner"), region.pixels.min.x, region.pixels.min.y);
  glUniform1i(program.at("turn"), int(region.round % 8));
  // Depth as OpenGL has it grows from -1 at the nearest: as 1 - 2 n / Z in perspective, where W is Z, else evenly.
  const float nearest = std::max(region.nearest, 1e-4f * std::abs(region.farthest) + 1e-6f);
  if (region.perspective) {
    glUniform2f(program.at("clip_depth"), 1, -2 * nearest);
  } else {
    const float span = std::max(region.farthest - region.nearest, 1e-6f * std::abs(region.farthest) + 1e-6f);
    glUniform2f(program.at("clip_depth"), 1 / span, -region.nearest / span - 0.5f);
  }
}

}  // namespace dapple::glimpostor
