// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/tile_store.h"

#include <stdexcept>

#include "dapple/base/timer.h"

namespace dapple::forest {

TileStore::TilePtr TileStore::fetch(const TileKey& key, const Make& make) {
  EntryPtr entry;
  bool mine = false;
  {
    const std::lock_guard lock(mutex_);
    ++state_.lookups;
    EntryPtr& known = entries_[key];
    if (known) {
      known->recent = true;
    } else {
      known = std::make_shared<Entry>();
      known->key = key;
      mine = true;
    }
    entry = known;
  }
  if (mine) {
    const Timer timer;
    try {
      entry->tile = make();
    } catch (...) {
      entry->failed = true;
      publish(entry, timer.seconds());
      throw;
    }
    publish(entry, timer.seconds());
  } else {
    entry->ready.wait(false, std::memory_order_acquire);
    if (entry->failed) throw std::runtime_error("a tile of shadow masks could not be made");
  }
  return {entry, &entry->tile};
}

void TileStore::publish(const EntryPtr& entry, double seconds) {
  {
    const std::lock_guard lock(mutex_);
    ++state_.fills;
    state_.fill_seconds += seconds;
    state_.bytes += entry->tile.bytes();
    queue_.push_back(entry);
    make_room();
    state_.peak_bytes = std::max(state_.peak_bytes, state_.bytes);
  }
  entry->ready.store(true, std::memory_order_release);
  entry->ready.notify_all();
}

void TileStore::make_room() {
  for (size_t looked_at = 2 * queue_.size(); state_.bytes > max_bytes_ && looked_at > 0 && !queue_.empty();
       --looked_at) {
    EntryPtr oldest = std::move(queue_.front());
    queue_.pop_front();
    if (oldest->recent) {
      oldest->recent = false;
      queue_.push_back(std::move(oldest));
      continue;
    }
    state_.bytes -= oldest->tile.bytes();
    ++state_.evictions;
    entries_.erase(oldest->key);
  }
}

TileStore::State TileStore::state() const {
  const std::lock_guard lock(mutex_);
  State s = state_;
  s.capacity_bytes = max_bytes_;
  return s;
}

}  // namespace dapple::forest
