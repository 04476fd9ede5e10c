// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <memory>

#include "dapple/gi/radiosity_cache.h"
#include "dapple/integrate/point_batch.h"

namespace dapple::gi {

/// Look-ups of a batch's diffuse rays in the radiosity cache.
struct CacheBatch {
  static constexpr int capacity = integrate::RaySet::capacity * integrate::PointBatch::most_ray_sets;

  explicit CacheBatch(int groups);

  int count = 0;          ///< rays that end in the cache
  uint8_t set[capacity];  ///< set of rays that the ray belongs to
  int ray[capacity];      ///< index of the ray in that set
  scene::GridPoint point[capacity];
  uint8_t nearest[capacity];  ///< index of the nearest point of the tile
  float leaving[capacity];    ///< towards the ray, of what its point sends on average
  int entry_of[capacity];

  int entry_count = 0;
  RadiosityCache::Entry entry[capacity];
  TileLinks links[capacity];  ///< of entries that are being filled

  // Where the points under way belong.
  int target_entry[integrate::PointBatch::capacity], target_point[integrate::PointBatch::capacity];

  /// Points of an entry that this thread has to compute.
  uint32_t to_fill(int e) const { return entry[e].found == TileCache::Found::pending ? 0 : entry[e].missing(); }
  /// The entry of this key, the same for equal keys. It becomes that of a look-up at this depth if it is new.
  int add_entry(uint64_t of_key, const scene::GridId& grid, int diffuse_depth);
  /// What is known of the tile that a hit was diced into, by its slot(): the entry that serves all such hits, or one of
  /// these.
  static constexpr int unknown = -1, near_light = -2;
  int answer(const scene::GridId& tile, uint32_t slot) const {
    const Answer& a = answers[slot % answer_count];
    return a.entry != unknown && a.tile == tile ? a.entry : unknown;
  }
  void set_answer(const scene::GridId& tile, uint32_t slot, int of_tile) {
    answers[slot % answer_count] = {tile, of_tile};
  }
  /// For at most so many look-ups.
  void clear(int most) {
    count = entry_count = 0;
    slots_in_use = std::bit_ceil(4 * uint32_t(most));
    std::fill_n(slots, slots_in_use, uint16_t(0));
    for (Answer& a : answers) a.entry = unknown;
  }

 private:
  static constexpr int answer_count = 1024;
  struct Answer {
    scene::GridId tile;
    int entry;
  } answers[answer_count];
  uint32_t slots_in_use = 0;
  uint16_t slots[4 * capacity];       ///< a hash table of entries + 1; 0: empty
  std::unique_ptr<uint32_t[]> words;  ///< of the entries
};

inline CacheBatch::CacheBatch(int groups) {
  const int each = RadiosityCache::words(RadiosityCache::max_points, groups);
  words = std::make_unique_for_overwrite<uint32_t[]>(size_t(each) *
                                                     capacity);  // pages that no batch needs are never touched
  for (int e = 0; e < capacity; ++e) entry[e].words = words.get() + e * each, entry[e].groups = groups;
}

inline int CacheBatch::add_entry(uint64_t of_key, const scene::GridId& grid, int diffuse_depth) {
  for (uint64_t slot = of_key;; ++slot) {
    uint16_t& found = slots[slot & (slots_in_use - 1)];
    if (found > 0 && entry[found - 1].key != of_key) continue;
    if (found == 0) {
      found = uint16_t(++entry_count);
      RadiosityCache::Entry& e = entry[found - 1];
      e.grid = grid;
      e.key = of_key;
      e.diffuse_depth = diffuse_depth;
      e.needed = 0;
      e.found = TileCache::Found::refused;
      e.outcome = RadiosityCache::Entry::Outcome::hit;
    }
    return found - 1;
  }
}

}  // namespace dapple::gi
