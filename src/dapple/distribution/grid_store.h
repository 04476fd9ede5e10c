// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <deque>
#include <memory>
#include <mutex>
#include <vector>

#include "dapple/gi/tile_links.h"
#include "dapple/integrate/integrator.h"
#include "dapple/scattering/bsdf.h"
#include "dapple/scene/patch_table.h"

namespace dapple::distribution {

/// The shading points of one tile: what its shaders gave that all camera samples share.
struct ShadingGrid {
  /// `with_bsdf`: the material scatters differently from point to point.
  ShadingGrid(const scene::GridId& grid_id, uint64_t hash_of_id, int light_groups, bool with_bsdf)
      : id(grid_id),
        hash(hash_of_id),
        groups(light_groups),
        diffuse(std::make_unique<RGB[]>(size_t(grid_id.count() * (1 + groups)))),
        bsdf(with_bsdf ? std::make_unique<scattering::Bsdf[]>(size_t(grid_id.count())) : nullptr) {}

  /// Sets of what there is in a grid: bits of its points, and of its links.
  using Parts = uint32_t;
  static constexpr Parts linked = 1u << 31;

  const scene::GridId id;
  const uint64_t hash;
  std::shared_ptr<ShadingGrid> next;  ///< in its bucket of the store; under the lock of its shard
  int groups;                         ///< of lights
  std::unique_ptr<RGB[]> diffuse;     ///< radiance by diffuse lobes: of all points, then its parts, point by point
  std::unique_ptr<scattering::Bsdf[]> bsdf;  ///< null where the material scatters the same everywhere
  gi::TileLinks links;
  std::atomic<Parts> claimed{0}, taken{0}, ready{0};
  bool recent = false;  ///< claimed again since the store last thought of dropping it; under the lock of its shard

  /// Claims what nobody has claimed of these points: the caller must see to it that they are shaded, at the end of the
  /// pass at the latest.
  Parts claim(Parts points) {
    points &= ~claimed.load(std::memory_order_relaxed);  // most samples find all claimed, and need not write
    return points ? points & ~claimed.fetch_or(points, std::memory_order_relaxed) : 0;
  }
  /// Takes what nobody has taken of claimed points, whoever claimed them: the caller must shade them at once, without
  /// waiting for other grids, and then publish() them.
  Parts take(Parts points) { return points & ~taken.fetch_or(points, std::memory_order_relaxed); }
  void publish(Parts mine) {
    ready.fetch_or(mine, std::memory_order_release);
    ready.notify_all();
  }
  Parts unready(Parts wanted) const { return wanted & ~ready.load(std::memory_order_acquire); }
  bool has(Parts wanted) const { return unready(wanted) == 0; }
  /// Returns when these parts, taken by other threads (links: claimed), are ready. Those may wait for entries of the
  /// radiosity cache in the meantime, but not for grids: they wait for those when they have published their own.
  void wait(Parts wanted) const {
    for (Parts now; ((now = ready.load(std::memory_order_acquire)) & wanted) != wanted;)
      ready.wait(now, std::memory_order_acquire);
  }

  RGB* parts(int point) const { return diffuse.get() + id.count() + point * groups; }
  size_t bytes() const;
};

/// Grids by name, shared by all threads, in a number of bytes; beyond it those that were not claimed of late are
/// dropped, first in first out. What a grid holds is a pure function of its name, so it does not matter which thread
/// shades it, or how often.
class GridStore {
 public:
  using GridPtr = std::shared_ptr<ShadingGrid>;

  GridStore(size_t max_bytes, int light_groups) : max_bytes_(max_bytes), groups_(light_groups) {}

  struct Claim {
    GridPtr grid;
    bool mine;  ///< it is new: the caller must link it, and then publish its links
  };
  /// `with_bsdf`: of a new grid.
  Claim claim(const scene::GridId& id, bool with_bsdf);

  /// Drops all grids, of which nobody may hold one.
  void clear();

  /// Without counts.
  integrate::CacheState state() const;

 private:
  static constexpr size_t shard_count = 64;
  struct Shard {
    std::mutex mutex;
    std::vector<GridPtr> buckets =
        std::vector<GridPtr>(16);  ///< a power of two of them, by hashes: no more grids than these
    std::deque<GridPtr> queue;     ///< of all its grids
    size_t bytes = 0;

    GridPtr& bucket(uint64_t hash) { return buckets[hash & (buckets.size() - 1)]; }
    void insert(const GridPtr& grid);
    void erase(const ShadingGrid& grid);
  };
  void make_room(Shard& shard);

  const size_t max_bytes_;
  const int groups_;
  std::atomic<size_t> bytes_{0}, peak_bytes_{0};
  std::atomic<uint64_t> evictions_{0};
  Shard shards_[shard_count];
};

}  // namespace dapple::distribution
