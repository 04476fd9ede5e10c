// SPDX-License-Identifier: Apache-2.0
#include "dapple/gi/tile_cache.h"

#include <bit>
#include <string>

#include "dapple/base/error.h"

namespace dapple::gi {

namespace {

// A word of a set; a std::mutex is ten times as large.
class WordLock {
 public:
  explicit WordLock(std::atomic<uint32_t>& lock) : lock_(lock) {
    while (lock_.exchange(1, std::memory_order_acquire)) lock_.wait(1, std::memory_order_relaxed);
  }
  ~WordLock() {
    lock_.store(0, std::memory_order_release);
    lock_.notify_one();
  }
  WordLock(const WordLock&) = delete;
  WordLock& operator=(const WordLock&) = delete;

 private:
  std::atomic<uint32_t>& lock_;
};

// Memory in use from the beginning; more is taken into use where entries hold more than one byte in so many.
constexpr size_t first_bytes = 1 << 20;
constexpr size_t sparse = 8;

}  // namespace

TileCache::TileCache(size_t bytes, int words, int small_words)
    : words_(words),
      small_words_(small_words),
      large_ways_(small_words > 0 ? ways - small_ways : ways),
      set_count_(bytes / set_bytes()) {
  if (set_count_ > ~uint32_t(0)) set_count_ = ~uint32_t(0);
  if (set_count_ == 0) return;
  constexpr size_t line = alignof(Header);
  memory_.reset(static_cast<std::byte*>(std::calloc(set_count_ * set_bytes() + line, 1)));
  if (!memory_) throw MemoryError("a cache of " + std::to_string(bytes >> 20) + " MB does not fit the memory");
  std::byte* first = memory_.get() + (line - reinterpret_cast<uintptr_t>(memory_.get()) % line) % line;
  headers_ = reinterpret_cast<Header*>(first);
  payloads_ = reinterpret_cast<std::atomic<uint32_t>*>(first + set_count_ * sizeof(Header));
  Growth g{0, 0};
  while (multiples(g.level) * set_bytes() > first_bytes) ++g.level;
  growth_ = pack(g);
}

// Where a set lies: multiples of higher powers of two come first, so that the sets in use are always the first ones.
uint32_t TileCache::place_of(uint64_t set) const {
  if (set == 0) return 0;
  const uint32_t power = uint32_t(std::countr_zero(set)) + 1;
  return uint32_t(multiples(power) + (set >> power));
}

uint32_t TileCache::set_of(uint64_t key) const {
  const Growth g = unpack(growth_.load(std::memory_order_acquire));
  const uint64_t home = home_of(key), multiple = home >> g.level;
  const uint32_t level = multiple < g.split ? g.level - 1 : g.level;
  return place_of(home >> level << level);
}

// Ends that a way is reserved. Under the lock.
void TileCache::release(Header& h, uint32_t way) {
  h.awaited = uint16_t(h.awaited & ~(1u << way));
  h.version[way].fetch_add(1, std::memory_order_release);
  h.version[way].notify_all();
}

// Takes some more sets into use, unless another thread does.
void TileCache::grow_if_crowded() {
  const Growth now = unpack(growth_.load(std::memory_order_relaxed));
  if (now.level == 0 || sparse * bytes_in_use() < (multiples(now.level) + now.split) * set_bytes()) return;
  if (growing_.test_and_set(std::memory_order_acquire)) return;
  for (int i = 0; i < 4; ++i)
    if (const Growth g = unpack(growth_.load(std::memory_order_relaxed)); g.level > 0) split_one(g);
  growing_.clear(std::memory_order_release);
}

// Moves those entries of the next set that belong to the set after it.
void TileCache::split_one(Growth g) {
  const uint64_t odd = 2 * uint64_t(g.split) + 1, half = uint64_t(1) << (g.level - 1);
  const uint64_t next = pack(g.split + 1 == multiples(g.level) ? Growth{g.level - 1, 0} : Growth{g.level, g.split + 1});
  if (odd * half >= set_count_) {
    growth_.store(next, std::memory_order_release);
    return;
  }
  const uint32_t from = place_of((odd - 1) * half), to = place_of(odd * half);
  Header &h = headers_[from], &t = headers_[to];
  const WordLock lock(h.lock);
  bool moves[ways];
  for (uint32_t way = 0; way < ways; ++way) {
    const uint64_t key = h.key[way].load(std::memory_order_relaxed);
    moves[way] = key != 0 && (home_of(key) >> (g.level - 1) & 1);
    if (!moves[way]) continue;
    for (int i = 0, n = words_in(way); i < n; ++i)
      payload(to, way)[i].store(payload(from, way)[i].load(std::memory_order_relaxed), std::memory_order_relaxed);
    t.tag[way] = h.tag[way];
    t.lives[way].store(h.lives[way].load(std::memory_order_relaxed), std::memory_order_relaxed);
    const uint32_t computing = h.version[way].load(std::memory_order_relaxed) & 1;
    t.version[way].store(computing, std::memory_order_relaxed);
    t.awaited = uint16_t(t.awaited | computing << way);
    t.key[way].store(key, std::memory_order_relaxed);
  }
  // Nobody has looked into the other set before this. Readers that still look here find whole entries, or a version
  // that has changed.
  growth_.store(next, std::memory_order_release);
  for (uint32_t way = 0; way < ways; ++way) {
    if (!moves[way]) continue;
    h.key[way].store(0, std::memory_order_release);
    const bool computing = h.version[way].load(std::memory_order_relaxed) & 1;
    if (!computing)
      h.version[way].fetch_add(2, std::memory_order_release);
    else if (h.awaited >> way & 1)
      release(h, way);
    // else it stays reserved: that is where finish() looks first
  }
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
    if (h.version[way].load(std::memory_order_acquire) != version || h.key[way].load(std::memory_order_relaxed) != key)
      return false;
    h.revive(way, Lives().most);
    return true;
  }
  return false;
}

void TileCache::prefetch(uint64_t key) const {
  if (set_count_ == 0) return;
  const uint32_t set = set_of(key), way = way_of(key, 0);
  const Header& h = headers_[set];
  __builtin_prefetch(&h.key[way]);
  __builtin_prefetch(&h.version[way]);
  __builtin_prefetch(&h.lives[way], 1);
  const std::atomic<uint32_t>* const words = payload(set, way);
  __builtin_prefetch(words);
  __builtin_prefetch(words + words_in(way) - 1);
}

TileCache::Found TileCache::look(uint32_t set, uint64_t key, uint32_t* out, Slot* slot, uint8_t lives) const {
  Header& h = headers_[set];
  for (uint32_t i = 0; i < ways; ++i) {
    const uint32_t way = way_of(key, i);
    if (h.key[way].load(std::memory_order_acquire) != key) continue;
    const uint32_t version = h.version[way].load(std::memory_order_acquire);
    if (h.key[way].load(std::memory_order_acquire) != key) continue;
    *slot = {key, set, way, version, -1};
    if (version & 1) return Found::pending;
    if (!read(set, way, key, version, out)) continue;
    h.revive(way, lives);
    return Found::ready;
  }
  return Found::refused;
}

TileCache::Found TileCache::find(uint64_t key, uint32_t* out, Slot* slot, const Kind& kind) {
  if (set_count_ == 0) return Found::refused;
  if (key == 0) key = 1;
  for (;;) {
    const uint32_t set = set_of(key);
    if (const Found found = look(set, key, out, slot, kind.lives.most); found != Found::refused) return found;
    {
      const WordLock lock(headers_[set].lock);
      if (set_of(key) != set) continue;  // it has been moved
      if (const Found found = look(set, key, out, slot, kind.lives.most); found != Found::refused) return found;
      if (!claim(set, key, slot, kind)) return Found::refused;
    }
    if (slot->evicted < 0) grow_if_crowded();
    return Found::mine;
  }
}

// Under the lock.
bool TileCache::claim(uint32_t set, uint64_t key, Slot* slot, const Kind& kind) {
  Header& h = headers_[set];
  const uint32_t way = choose_victim(h, key, kind.small);
  if (way == ways) return false;
  const uint32_t version = h.version[way].load(std::memory_order_acquire);
  const bool empty = h.key[way].load(std::memory_order_relaxed) == 0;
  if (empty)
    used_.fetch_add(entry_bytes(words_in(way)), std::memory_order_relaxed);
  else
    evictions_.fetch_add(1, std::memory_order_relaxed);
  h.version[way].store(version + 1, std::memory_order_release);
  h.key[way].store(key, std::memory_order_release);
  h.lives[way].store(kind.lives.first, std::memory_order_relaxed);
  *slot = {key, set, way, version + 1, empty ? -1 : h.tag[way]};
  h.tag[way] = kind.tag;
  return true;
}

// A way that is empty, of its own size if there is one, the nearest to where the key is looked for first; or the first
// one without lives that the hand comes by: others lose one as it passes. `ways`: all are being filled. Under the lock.
uint32_t TileCache::choose_victim(Header& h, uint64_t key, bool small) const {
  uint32_t larger = ways;
  for (uint32_t i = 0; i < ways; ++i) {
    const uint32_t way = way_of(key, i);
    if (h.key[way].load(std::memory_order_relaxed) != 0 || (h.version[way].load(std::memory_order_acquire) & 1))
      continue;
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
  const WordLock lock(h.lock);
  if (h.version[slot->way].load(std::memory_order_acquire) != slot->version) return false;
  h.version[slot->way].store(++slot->version, std::memory_order_release);
  return true;
}

void TileCache::publish(const Slot& slot, const uint32_t* words) {
  finish(slot, [&](uint32_t set) {
    std::atomic<uint32_t>* to = payload(set, slot.way);
    for (int i = 0, n = words_in(slot.way); i < n; ++i) to[i].store(words[i], std::memory_order_release);
  });
}

void TileCache::abandon(const Slot& slot) {
  finish(slot, [&](uint32_t set) {
    headers_[set].key[slot.way].store(0, std::memory_order_relaxed);
    used_.fetch_sub(entry_bytes(slot), std::memory_order_relaxed);
  });
}

// Ends the computing of an entry: where it was claimed, or in the set it belongs to by now, where the same way waits
// for it.
template <class Do>
void TileCache::finish(const Slot& slot, Do what) {
  for (uint32_t set = slot.set;; set = set_of(slot.key)) {
    Header& h = headers_[set];
    const WordLock lock(h.lock);
    const bool here = h.key[slot.way].load(std::memory_order_relaxed) == slot.key;
    if (here) what(set);
    if (here || set == slot.set) release(h, slot.way);
    if (here) return;
  }
}

bool TileCache::wait(const Slot& slot, uint32_t* out) const {
  const Header& h = headers_[slot.set];
  h.version[slot.way].wait(slot.version, std::memory_order_acquire);
  return read(slot.set, slot.way, slot.key, slot.version + 1, out);
}

}  // namespace dapple::gi
