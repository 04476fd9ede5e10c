// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "dapple/scene/patch_table.h"
#include "dapple/shading/bsdf.h"

namespace dapple::integrate {

/// The shading points of one tile: what its shaders gave that all camera samples share.
struct ShadingGrid {
  explicit ShadingGrid(const scene::GridId& grid_id) : id(grid_id), diffuse(std::make_unique<RGB[]>(size_t(grid_id.count()))) {}

  scene::GridId id;
  std::unique_ptr<RGB[]> diffuse;          ///< radiance by diffuse lobes
  std::unique_ptr<shading::Bsdf[]> bsdf;   ///< null where the material scatters the same everywhere
  std::atomic<bool> ready{false};
  bool kept = false;  ///< belongs to the store

  size_t bytes() const;
};

/// Grids by name, shared by all threads, up to a number of bytes. What a grid holds is a pure function of its name, so it does not
/// matter which thread shades it, or whether it is kept.
class GridStore {
 public:
  explicit GridStore(size_t max_bytes) : max_bytes_(max_bytes) {}

  struct Claim {
    ShadingGrid* grid;  ///< null: the store is full and does not hold it
    bool mine;          ///< the caller must shade it and then call publish()
  };
  Claim claim(const scene::GridId& id);
  void publish(ShadingGrid& grid);
  /// Returns when the grid, claimed by another thread, is ready. That thread waits for nobody in the meantime.
  static void wait(const ShadingGrid& grid) { grid.ready.wait(false, std::memory_order_acquire); }

  size_t bytes() const { return bytes_; }

 private:
  static constexpr size_t shard_count = 64;
  struct Hash {
    size_t operator()(const scene::GridId& id) const { return id.hash(); }
  };
  struct Shard {
    std::mutex mutex;
    std::unordered_map<scene::GridId, std::unique_ptr<ShadingGrid>, Hash> grids;
  };

  const size_t max_bytes_;
  std::atomic<size_t> bytes_{0};
  Shard shards_[shard_count];
};

}  // namespace dapple::integrate
