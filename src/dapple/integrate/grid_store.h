// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <deque>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "dapple/integrate/integrator.h"
#include "dapple/integrate/tile_links.h"
#include "dapple/scene/patch_table.h"
#include "dapple/shading/bsdf.h"

namespace dapple::integrate {

/// The shading points of one tile: what its shaders gave that all camera samples share.
struct ShadingGrid {
  ShadingGrid(const scene::GridId& grid_id, int light_groups)
      : id(grid_id), groups(light_groups), diffuse(std::make_unique<RGB[]>(size_t(grid_id.count() * (1 + groups)))) {}

  scene::GridId id;
  int groups;  ///< of lights
  std::unique_ptr<RGB[]> diffuse;  ///< radiance by diffuse lobes: of all points, then its parts, point by point
  TileLinks links;
  std::unique_ptr<shading::Bsdf[]> bsdf;   ///< null where the material scatters the same everywhere
  std::atomic<bool> ready{false};
  bool recent = false;  ///< claimed again since the store last thought of dropping it; under the lock of its shard

  RGB* parts(int point) const { return diffuse.get() + id.count() + point * groups; }
  size_t bytes() const;
};

/// Grids by name, shared by all threads, in a number of bytes; beyond it those that were not claimed of late are dropped, first in first
/// out. What a grid holds is a pure function of its name, so it does not matter which thread shades it, or how often.
class GridStore {
 public:
  using GridPtr = std::shared_ptr<ShadingGrid>;

  GridStore(size_t max_bytes, int light_groups) : max_bytes_(max_bytes), groups_(light_groups) {}

  struct Claim {
    GridPtr grid;
    bool mine;  ///< the caller must shade it and then call publish()
  };
  Claim claim(const scene::GridId& id);
  void publish(ShadingGrid& grid);
  /// Returns when the grid, claimed by another thread, is ready. That thread may wait for entries of the radiosity cache in the meantime,
  /// but not for grids: it waits for those when it has published its own.
  static void wait(const ShadingGrid& grid) { grid.ready.wait(false, std::memory_order_acquire); }

  /// Without counts.
  CacheState state() const;

 private:
  static constexpr size_t shard_count = 64;
  struct Hash {
    size_t operator()(const scene::GridId& id) const { return id.hash(); }
  };
  struct Shard {
    std::mutex mutex;
    std::unordered_map<scene::GridId, GridPtr, Hash> grids;
    std::deque<GridPtr> queue;
    size_t bytes = 0;
  };
  void make_room(Shard& shard);

  const size_t max_bytes_;
  const int groups_;
  std::atomic<size_t> bytes_{0}, peak_bytes_{0};
  std::atomic<uint64_t> evictions_{0};
  Shard shards_[shard_count];
};

}  // namespace dapple::integrate
