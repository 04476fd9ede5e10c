// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/gi/tile_cache.h"
#include "dapple/gi/tile_links.h"
#include "dapple/integrate/integrator.h"
#include "dapple/integrate/light_sums.h"
#include "dapple/scene/patch_table.h"

namespace dapple::gi {

/// The radiosity of tiles of shading points, diced at any rate that is a power of two (multiresolution radiosity
/// caching, Christensen et al. 2012). Memory and statistics know three resolutions. Coarse: the whole patch, or a group
/// of patches, in at most 4 points. Medium: tiles of a patch of at most 64 points. Fine: tiles of a patch of more. A
/// share of the memory is for coarse tiles alone, so that the others, of which there are many, cannot drive them out.
///
/// An entry holds those points of its tile that look-ups have wanted so far, and says which points belong together
/// (TileLinks). Values are diffuse radiance (radiosity / pi), direct and indirect, without emission, in 16 bits a
/// channel (gi/packed_radiance.h), and where they are kept, the parts of it by groups of lights.
class RadiosityCache {
 public:
  static constexpr int max_points = scene::GridId::tile * scene::GridId::tile;

  /// An entry, as a look-up works with it: a copy.
  struct Entry {
    scene::GridId grid;
    uint64_t key = 0;
    int diffuse_depth = 1;  ///< bounces between the camera and it
    uint32_t needed = 0;    ///< bit set of the points that the look-up wants
    TileCache::Found found = TileCache::Found::refused;
    TileCache::Slot slot;
    enum class Outcome : uint8_t {
      hit,
      extended,
      filled
    } outcome = Outcome::hit;   ///< what the look-up came to, for the statistics
    uint32_t* words = nullptr;  ///< room for those of max_points
    int groups = 0;

    void set(int point, const integrate::LightParts& value);
    void set_black(int point);
    /// Adds a point's value to sum i.
    void add_to(integrate::LightSums& sums, int i, int point, float weight) const;
    void set_links(const TileLinks& links);
    TileLinks links() const { return {words[0] & TileLinks::all_parts, words[1]}; }
    void clear() { words[0] = 0; }
    /// Points that have been computed: of an entry that has some, so have the links.
    uint32_t known() const { return words[0] >> TileLinks::most_parts; }
    uint32_t missing() const { return needed & ~known(); }

   private:
    std::byte* values(int point) const;
    void set_known(int point) { words[0] |= 1u << (TileLinks::most_parts + point); }
  };

  /// `groups`: of lights.
  RadiosityCache(size_t bytes, int groups);

  /// Of an entry of so many points.
  static constexpr int words(int points, int groups) { return TileLinks::words + points * (1 + groups) * 3 / 2; }

  static integrate::Resolution resolution(const scene::GridId& grid);
  static uint64_t key(uint64_t hash_of_grid, int diffuse_depth) { return hash(hash_of_grid, diffuse_depth); }

  /// What became of look-ups.
  struct Counts {
    integrate::CacheCounts by_resolution[integrate::resolution_count];
    std::vector<integrate::CacheCounts> by_depth;  ///< of diffuse bounces: 0, 1, 2, ...

    void add(const Entry& entry, const integrate::CacheCounts& c) {
      by_resolution[size_t(resolution(entry.grid))] += c;
      by_depth[size_t(entry.diffuse_depth)] += c;
    }
  };

  /// Fills entry.found, and entry.words with what is known. Found::ready: that is all that is needed. Found::mine: the
  /// caller is to add what is missing. Found::refused: the same, for itself alone.
  void find(Entry& entry, Counts* counts);
  /// For a find() soon.
  void prefetch(const Entry& entry) const { cache_.prefetch(entry.key); }
  void publish(Entry& entry);
  void abandon(const Entry& entry);
  /// Waits for an entry that was pending. True if all that is needed is known then: Found::ready.
  bool wait(Entry& entry);

  /// Its memory, without a name and counts. The capacity of fine tiles is what the others do not take now.
  integrate::CacheState state(integrate::Resolution r) const;

 private:
  void count_memory(const Entry& entry, Counts* counts);

  TileCache cache_;
  struct Use {
    std::atomic<uint64_t> bytes{0}, evictions{0};
  };
  Use use_[integrate::resolution_count];  ///< changed by claims, and by abandon() after an exception
};

}  // namespace dapple::gi
