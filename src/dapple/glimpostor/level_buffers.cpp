// SPDX-License-Identifier: Apache-2.0
#include "dapple/glimpostor/level_buffers.h"

#include <bit>
#include <vector>

namespace dapple::glimpostor {

using depthimage::SplatLevel;

LevelBuffers::LevelBuffers(const SplatLevel& level) {
  struct Packed {
    float x, y, z, slope_u, slope_v;
    uint32_t mask_view, sides, unused;
  };
  static_assert(sizeof(Packed) == 32);
  std::vector<Packed> all;
  all.reserve(level.chunks.size() * SplatLevel::chunk_size);
  for (size_t c = 0; c < level.chunks.size(); ++c) {
    const SplatLevel::Lanes& from = level.lanes[c];
    for (uint32_t i = 0; i < uint32_t(SplatLevel::chunk_size); ++i) {
      const uint32_t mask = i < level.chunks[c].count ? from.mask[i] : 0;
      const auto byte = [](int8_t v, int place) { return uint32_t(uint8_t(v)) << (8 * place); };
      all.push_back(
          {from.x[i], from.y[i], from.z[i], from.slope_u[i], from.slope_v[i], mask | level.chunks[c].view << 16,
           byte(from.left[i], 0) | byte(from.right[i], 1) | byte(from.bottom[i], 2) | byte(from.top[i], 3), 0});
    }
  }
  fragments_.set(GL_RGBA32UI, all.data(), all.size() * sizeof(Packed), sizeof(Packed) / 2);
}

}  // namespace dapple::glimpostor
