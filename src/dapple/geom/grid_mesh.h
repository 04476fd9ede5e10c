// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "dapple/geom/surface_point.h"

namespace dapple::geom {

/// The diced patches of a surface: grids of micropolygons, one primitive each. Immutable once built, by dice().
struct GridMesh {
  /// Vertex (x, y) of a grid is first + y stride + x. At most 257 columns and rows. Laid out as Embree wants it.
  struct Grid {
    uint32_t first, stride;
    uint16_t columns, rows;
  };
  /// Which part of the cage a grid covers: a patch of a face, or a tile of that where it is diced finer than one grid
  /// holds.
  struct Part {
    uint32_t face;
    uint16_t sub;
    uint8_t u_level, v_level;  ///< log2 of the tiles along u and v
    uint8_t u_tile, v_tile;
    bool operator==(const Part&) const = default;
  };
  std::vector<V3f> P;      ///< its capacity is larger by one at least, since Embree reads 16 bytes at the last vertex
  std::vector<V3f> P_end;  ///< positions at shutter close; likewise; empty = the mesh does not deform
  std::vector<V3f> N;      ///< unit, outside; zero where there is none
  std::vector<V2f> uv;     ///< texture coordinates
  bool flip = false;       ///< outside is where cross(dP/dv, dP/du) points, by the grid's u and v
  std::vector<Grid> grids;
  std::vector<Part> parts;

  size_t bytes() const;
  size_t micropolygon_count() const;
  /// A number that depends only on the cage, for grids that are whole patches; those of tiles also on how often a patch
  /// is halved.
  uint64_t patch_number(uint32_t primitive) const;
  /// The surface at (u, v) in [0, 1]^2 of a grid. Each micropolygon is the triangles (0, 1, 3) and (2, 3, 1) of its
  /// corners going round. dPdu to dNdv, by the texture coordinates, are set if `tangents`.
  SurfacePoint at(uint32_t primitive, float u, float v, float time, bool tangents = true) const;
};

}  // namespace dapple::geom
