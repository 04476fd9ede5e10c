// SPDX-License-Identifier: Apache-2.0
#include "dapple/impostor/projection_device.h"

namespace dapple::impostor {

using depthimage::SampleMask;
using depthimage::SplatTile;

void SubSamples::put_into(const ImageView& view, const Box2i& block, SplatTile* tile) const {
  constexpr int grid = SampleMask::side;
  for (int y = block.min.y; y < block.max.y; ++y)
    for (int x = block.min.x; x < block.max.x; ++x) {
      const size_t first = size_t(y - pixels.min.y) * grid * width() + size_t(x - pixels.min.x) * grid;
      const V2i to(x % SplatTile::side * grid, y % SplatTile::side * grid);
      for (int s = 0; s < SampleMask::count; ++s) {
        const size_t from = first + size_t(s / grid) * width() + size_t(s % grid);
        if (draw[from] == none) continue;
        const SplatTile::Draw& drawn = view.draws()[draw[from]];
        const auto& chunks = drawn.object->levels[size_t(drawn.level)].chunks;
        const uint32_t chunk = fragment[from] / uint32_t(depthimage::SplatLevel::chunk_size);
        tile->put(V2i(to.x + s % grid, to.y + s / grid), {draw[from], chunks[chunk].view, fragment[from]}, depth[from]);
      }
    }
}

}  // namespace dapple::impostor
