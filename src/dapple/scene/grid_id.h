// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <compare>
#include <cstdint>

#include "dapple/trace/ray_batch.h"

namespace dapple::scene {

/// Names a tile of shading points: at most 4 x 4 cells of a patch diced 2^u_level by 2^v_level, or one point for a
/// group of patches. A shading point is the centre of its cell.
struct GridId {
  uint32_t instance = trace::no_id, geometry = 0;
  uint32_t patch = 0;               ///< or the group, where cluster_level > 0
  uint32_t tile_u = 0, tile_v = 0;  ///< of a group, tile_u says which of its patches stands for it
  uint8_t u_level = 0, v_level = 0, cluster_level = 0;
  uint8_t behind = 0;  ///< the side shaded: 1 = the one that Ng does not point to
  uint8_t span = 0;    ///< the time that it is shaded for (Motion)
  uint16_t medium =
      0;  ///< in which rays arrive, where that is not the same for all of them: a number above 0. 0: it is

  static constexpr int tile = 4;  ///< cells along an edge
  int width() const { return std::min(tile, 1 << u_level); }
  int height() const { return std::min(tile, 1 << v_level); }
  int count() const { return width() * height(); }
  int index(int i, int j) const { return j * width() + i; }  ///< of a cell in the tile
  uint64_t hash() const;
  /// Quickly, for small tables.
  uint32_t slot() const {
    const uint32_t levels =
        uint32_t(u_level) << 16 | uint32_t(v_level) << 8 | span << 1 | behind | uint32_t(medium) << 24;
    const uint32_t h = patch * 0x9e3779b1u + tile_u * 0x85ebca77u + tile_v * 0xc2b2ae3du +
                       (instance + geometry * 31) * 0x27d4eb2fu + levels * 0x165667b1u;
    return h >> 16 ^ h;
  }
  auto operator<=>(const GridId&) const = default;
};

/// A place on a tile, in cells from its first corner.
struct GridPoint {
  GridId grid;
  uint32_t patch = 0;  ///< that was hit, though a group may serve it
  uint8_t part = 0;    ///< of that group (geom::PatchClusters::parts)
  bool half = false;   ///< the patch that was hit is half of its lattice
  float x = 0, y = 0;

  int cell() const { return grid.index(std::min(int(x), grid.width() - 1), std::min(int(y), grid.height() - 1)); }
};

}  // namespace dapple::scene
