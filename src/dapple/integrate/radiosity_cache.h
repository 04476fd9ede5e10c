// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/gi/tile_cache.h"
#include "dapple/integrate/integrator.h"
#include "dapple/integrate/light_sums.h"
#include "dapple/integrate/tile_links.h"
#include "dapple/scene/patch_table.h"

namespace dapple::integrate {

/// The radiosity of tiles of shading points, at three resolutions with a budget each, so that fine tiles, of which there are many, cannot
/// drive out the coarse ones that most rays read (multiresolution radiosity caching, methods page section 2). Coarse: the whole patch, or a
/// group of patches, in at most 4 points. Medium: tiles of a patch of at most 64 points. Fine: tiles of a patch of more.
///
/// An entry also says which of its points belong together (TileLinks).
/// Values are diffuse radiance (radiosity / pi), direct and indirect, without emission, in 16 bits a channel (gi/packed_radiance.h), and
/// where they are kept, the parts of it by groups of lights.
class RadiosityCache {
 public:
  static constexpr int max_points = scene::GridId::tile * scene::GridId::tile;

  /// An entry, as a look-up works with it: a copy.
  struct Entry {
    scene::GridId grid;
    uint64_t key = 0;
    int diffuse_depth = 1;  ///< bounces between the camera and it
    uint32_t needed = 0;  ///< bit set of the points that the look-up wants
    gi::TileCache::Found found = gi::TileCache::Found::refused;
    gi::TileCache::Slot slot;
    bool lost = false;  ///< another thread's, and replaced before it could be read
    uint32_t* words = nullptr;  ///< room for those of max_points
    int groups = 0;

    void set(int point, const LightParts& value);
    /// Adds a point's value to sum i.
    void add_to(LightSums& sums, int i, int point, float weight) const;
    void set_links(const TileLinks& links);
    TileLinks links() const;
  };

  /// `groups`: of lights.
  RadiosityCache(size_t bytes, int groups);

  /// Of an entry of so many points.
  static constexpr int words(int points, int groups) { return TileLinks::words + points * (1 + groups) * 3 / 2; }

  static Resolution resolution(const scene::GridId& grid);
  static uint64_t key(const scene::GridId& grid, int diffuse_depth) { return hash(grid.hash(), diffuse_depth); }

  /// What became of look-ups.
  struct Counts {
    CacheCounts by_resolution[resolution_count];
    std::vector<CacheCounts> by_depth;  ///< of diffuse bounces: 0, 1, 2, ...

    void add(const Entry& entry, const CacheCounts& c) {
      by_resolution[size_t(resolution(entry.grid))] += c;
      by_depth[size_t(entry.diffuse_depth)] += c;
    }
  };

  /// Fills entry.found, and entry.words where it is ready.
  void find(Entry& entry, Counts* counts);
  /// An entry that was pending turned out to be gone: the look-up was no hit.
  static void count_lost(const Entry& entry, Counts* counts) { counts->add(entry, {0, ~uint64_t(0), 1, 0}); }
  void publish(const Entry& entry) { area(entry).publish(entry.slot, entry.words); }
  void abandon(const Entry& entry) { area(entry).abandon(entry.slot); }
  bool wait(Entry& entry) { return area(entry).wait(entry.key, entry.slot, entry.words); }

  const gi::TileCache& area(Resolution r) const { return areas_[size_t(r)]; }

 private:
  void count_memory(const Entry& entry, Counts* counts);
  gi::TileCache& area(const Entry& e) { return areas_[size_t(resolution(e.grid))]; }

  gi::TileCache areas_[resolution_count];
};

}  // namespace dapple::integrate
