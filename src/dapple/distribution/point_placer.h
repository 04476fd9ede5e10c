// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/shading_scene.h"

namespace dapple::distribution {

/// Places shading points on their tiles, and says where the rays of each start: writes the inputs of a batch. A point
/// is a pure function of its tile's name and `key`, of the tile's random numbers. Needs ShadingScene::patches.
class PointPlacer {
 public:
  explicit PointPlacer(const ShadingScene& shading) : shading_(shading) {}

  /// Point k of a batch: cell (i, j) of a tile, whose rays start in its middle.
  void place(const scene::GridId& grid, int i, int j, const scene::PatchTable::Cell& cell, uint64_t key,
             scene::PatchTable::Extents* memory, integrate::PointBatch& b, int k) const;

  /// The same, with the origins of its rays spread over the cell: pixels would show shadows' edges as steps from point
  /// to point.
  void place_seen_cell(const scene::GridId& grid, int i, int j, const scene::PatchTable::Cell& cell, uint64_t key,
                       const gi::TileLinks& links, scene::PatchTable::Extents* memory, integrate::PointBatch& b,
                       int k) const;

  /// As place_seen_cell(), for the cache: what coarse cells hold is a mean, of patterns too, not what happens to be at
  /// their middle. `depth`: diffuse, of the rays that read it; 0: of none.
  void place_cached_cell(const scene::GridId& grid, int i, int j, const scene::PatchTable::Cell& cell, uint64_t key,
                         int depth, const gi::TileLinks& links, scene::PatchTable::Extents* memory,
                         integrate::PointBatch& b, int k) const;

  /// Where such a point is at another time.
  geom::SurfacePoint surface_at(const integrate::PointBatch& b, int k, float time) const {
    return shading_.scene.traced.surface(b.place(k), integrate::PointBatch::lane(k), time, false);
  }

 private:
  void place_middle(const scene::GridId& grid, int i, int j, const scene::PatchTable::Cell& cell, uint64_t key,
                    scene::PatchTable::Extents* memory, integrate::PointBatch& b, int k) const;
  /// Of a group of patches, over four of them that are linked. `of_mean`: patterns are seen from one of the origins.
  void spread_origins(const scene::GridId& grid, int i, int j, const gi::TileLinks& links, bool of_mean,
                      scene::PatchTable::Extents* memory, integrate::PointBatch& b, int k) const;

  const ShadingScene& shading_;
};

}  // namespace dapple::distribution
