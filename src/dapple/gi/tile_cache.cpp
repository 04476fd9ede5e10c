// SPDX-License-Identifier: Apache-2.0
#include "dapple/gi/tile_cache.h"

#include <string>

#include "dapple/base/error.h"

namespace dapple::gi {

namespace {

class SpinLock {
 public:
  explicit SpinLock(std::atomic<uint32_t>& lock) : lock_(lock) {
    while (lock_.exchange(1, std::memory_order_acquire)) lock_.wait(1, std::memory_order_relaxed);
  }
  ~SpinLock() {
    lock_.store(0, std::memory_order_release);
    lock_.notify_one();
  }
  SpinLock(const SpinLock&) = delete;
  SpinLock& operator=(const SpinLock&) = delete;

 private:
  std::atomic<uint32_t>& lock_;
};

}  // namespace

TileCache::TileCache(size_t bytes, int words, int small_words)
    : words_(words), small_words_(small_words), large_ways_(small_words > 0 ? ways - small_ways : ways), set_count_(bytes / set_bytes()) {
  if (set_count_ > ~uint32_t(0)) set_count_ = ~uint32_t(0);
  if (set_count_ == 0) return;
  constexpr size_t line = alignof(Header);
  memory_.reset(static_cast<std::byte*>(std::calloc(set_count_ * set_bytes() + line, 1)));
  if (!memory_) throw MemoryError("a cache of " + std::to_string(bytes >> 20) + " MB does not fit the memory");
  std::byte* first = memory_.get() + (line - reinterpret_cast<uintptr_t>(memory_.get()) % line) % line;
  headers_ = reinterpret_cast<Header*>(first);
  payloads_ = reinterpret_cast<std::atomic<uint32_t>*>(first + set_count_ * sizeof(Header));
}

// The entry as of `version`, or false if it was not that of `key` all the time.
bool TileCache::read(uint32_t set, uint32_t way, uint64_t key, uint32_t version, uint32_t* out) const {
  const Header& h = headers_[set];
  const std::atomic<uint32_t>* from = payload(set, way);
  for (int i = 0, n = words_in(way); i < n; ++i) out[i] = from[i].load(std::memory_order_acquire);
  return h.version[way].load(std::memory_order_acquire) == version && h.key[way].load(std::memory_order_relaxed) == key;
}

bool TileCache::peek(uint64_t key, int word, uint32_t* out) const {
  if (set_count_ == 0) return false;
  if (key == 0) key = 1;
  const uint32_t set = set_of(key);
  Header& h = headers_[set];
  for (uint32_t i = 0; i < ways; ++i) {
    const uint32_t way = way_of(key, i);
    if (h.key[way].load(std::memory_order_acquire) != key) continue;
    const uint32_t version = h.version[way].load(std::memory_order_acquire);
    if (version & 1) return false;
    *out = payload(set, way)[word].load(std::memory_order_acquire);
    if (h.version[way].load(std::memory_order_acquire) != version || h.key[way].load(std::memory_order_relaxed) != key) return false;
    h.revive(way, Lives().most);
    return true;
  }
  return false;
}

TileCache::Found TileCache::find(uint64_t key, uint32_t* out, Slot* slot, const Kind& kind) {
  if (set_count_ == 0) return Found::refused;
  if (key == 0) key = 1;
  const uint32_t set = set_of(key);
  Header& h = headers_[set];
  const auto look = [&] {
    for (uint32_t i = 0; i < ways; ++i) {
      const uint32_t way = way_of(key, i);
      if (h.key[way].load(std::memory_order_acquire) != key) continue;
      const uint32_t version = h.version[way].load(std::memory_order_acquire);
      if (h.key[way].load(std::memory_order_acquire) != key) continue;
      *slot = {set, way, version, -1};
      if (version & 1) return Found::pending;
      if (!read(set, way, key, version, out)) continue;
      h.revive(way, kind.lives.most);
      return Found::ready;
    }
    return Found::refused;
  };
  if (const Found found = look(); found != Found::refused) return found;

  const SpinLock lock(h.lock);
  if (const Found found = look(); found != Found::refused) return found;
  const uint32_t way = choose_victim(h, key, kind.small);
  if (way == ways) return Found::refused;
  const uint32_t version = h.version[way].load(std::memory_order_acquire);
  const bool empty = h.key[way].load(std::memory_order_relaxed) == 0;
  if (empty)
    used_.fetch_add(entry_bytes(Slot{set, way}), std::memory_order_relaxed);
  else
    evictions_.fetch_add(1, std::memory_order_relaxed);
  h.version[way].store(version + 1, std::memory_order_release);
  h.key[way].store(key, std::memory_order_release);
  h.lives[way].store(kind.lives.first, std::memory_order_relaxed);
  *slot = {set, way, version + 1, empty ? -1 : h.tag[way]};
  h.tag[way] = kind.tag;
  return Found::mine;
}

// A way that is empty, of its own size if there is one, the nearest to where the key is looked for first; or the first one without lives
// that the hand comes by: others lose one as it passes. `ways`: all are being filled. Under the lock.
uint32_t TileCache::choose_victim(Header& h, uint64_t key, bool small) const {
  uint32_t larger = ways;
  for (uint32_t i = 0; i < ways; ++i) {
    const uint32_t way = way_of(key, i);
    if (h.key[way].load(std::memory_order_relaxed) != 0 || (h.version[way].load(std::memory_order_acquire) & 1)) continue;
    if (small == is_small(way)) return way;
    if (small && larger == ways) larger = way;
  }
  if (larger < ways) return larger;
  for (uint32_t i = 0; i < (most_lives + 1) * ways; ++i) {
    const uint32_t way = h.hand++ % ways;
    if (is_small(way) && !small) continue;
    if (h.version[way].load(std::memory_order_acquire) & 1) continue;
    const uint8_t left = h.lives[way].load(std::memory_order_relaxed);
    if (left == 0) return way;
    h.lives[way].store(left - 1, std::memory_order_relaxed);
  }
  return ways;
}

bool TileCache::reclaim(Slot* slot) {
  Header& h = headers_[slot->set];
  const SpinLock lock(h.lock);
  if (h.version[slot->way].load(std::memory_order_acquire) != slot->version) return false;
  h.version[slot->way].store(++slot->version, std::memory_order_release);
  return true;
}

void TileCache::publish(const Slot& slot, const uint32_t* words) {
  Header& h = headers_[slot.set];
  std::atomic<uint32_t>* to = payload(slot.set, slot.way);
  for (int i = 0, n = words_in(slot.way); i < n; ++i) to[i].store(words[i], std::memory_order_release);
  h.version[slot.way].store(slot.version + 1, std::memory_order_release);
  h.version[slot.way].notify_all();
}

void TileCache::abandon(const Slot& slot) {
  Header& h = headers_[slot.set];
  h.key[slot.way].store(0, std::memory_order_relaxed);
  used_.fetch_sub(entry_bytes(slot), std::memory_order_relaxed);
  h.version[slot.way].store(slot.version + 1, std::memory_order_release);
  h.version[slot.way].notify_all();
}

bool TileCache::wait(uint64_t key, const Slot& slot, uint32_t* out) const {
  if (key == 0) key = 1;
  const Header& h = headers_[slot.set];
  h.version[slot.way].wait(slot.version, std::memory_order_acquire);
  return read(slot.set, slot.way, key, slot.version + 1, out);
}

}  // namespace dapple::gi
