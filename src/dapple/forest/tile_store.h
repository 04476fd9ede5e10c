// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "dapple/base/hash.h"
#include "dapple/forest/slab_tile.h"

namespace dapple::forest {

struct TileKey {
  uint32_t map = 0;
  int32_t x = 0, y = 0;
  bool operator==(const TileKey&) const = default;
};

/// Tiles of any number of maps, made on demand, in a number of bytes. Beyond it, those that were not asked for of late
/// are dropped, first in first out. What a tile holds is a pure function of its key, so that it does not matter which
/// thread makes it, or how often. Tiles in the hands of threads are beyond the cap: one a thread.
class TileStore {
 public:
  using TilePtr = std::shared_ptr<const SlabTile>;
  using Make = std::function<SlabTile()>;

  explicit TileStore(size_t max_bytes) : max_bytes_(max_bytes) {}

  /// One lock a call: meant for batches of receivers.
  TilePtr fetch(const TileKey& key, const Make& make);

  struct State {
    uint64_t lookups = 0, fills = 0, evictions = 0;
    size_t bytes = 0, peak_bytes = 0, capacity_bytes = 0;
    double fill_seconds = 0;  ///< of all threads
  };
  State state() const;

 private:
  struct Entry {
    TileKey key;
    SlabTile tile;
    std::atomic<bool> ready{false};
    bool failed = false, recent = false;
  };
  using EntryPtr = std::shared_ptr<Entry>;
  struct Hash {
    size_t operator()(const TileKey& k) const { return hash(k.map, k.x, k.y); }
  };
  void publish(const EntryPtr& entry, double seconds);
  void make_room();

  const size_t max_bytes_;
  mutable std::mutex mutex_;
  std::unordered_map<TileKey, EntryPtr, Hash> entries_;
  std::deque<EntryPtr> queue_;
  State state_;
};

}  // namespace dapple::forest
