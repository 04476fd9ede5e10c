// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>

namespace dapple::gi {

/// A cache of entries of one or two sizes, in fixed memory, for many threads. Entries are pure functions of their keys,
/// so replacing one changes no image.
///
/// Memory is an array of sets of 16 entries; a key belongs to one set, where replacement is by second chance, of which
/// dear entries may have several (Lives). Where there are two sizes, 6 of them are small; small entries that find no
/// room there take that of large ones, as far as these are used less. Looking up takes no lock: each entry has a
/// version, odd while it is being filled, and a reader that finds the version changed reads again. Claiming an entry,
/// and publishing it, take the lock of its set. Nobody holds a lock, or a pointer into the cache, while an entry is
/// being computed.
///
/// Large memories are taken into use as entries come, by linear hashing (Litwin 1980): pages of the system's memory are
/// touched where there is something to keep, not one for each entry.
class TileCache {
 public:
  /// `bytes`: of everything, keys and versions included; below one set: nothing is ever kept. `words`: of 32 bits, in
  /// an entry; `small_words`: in small entries; 0: there are none. Throws MemoryError.
  TileCache(size_t bytes, int words, int small_words = 0);

  enum class Found : uint8_t {
    ready,    ///< out is written
    mine,     ///< the caller must compute it, then publish() or abandon()
    pending,  ///< another thread computes it: wait()
    refused   ///< there is no room: the caller computes it for itself
  };
  /// Number of times that the search for an entry to replace skips this one: when it is new, and after a look-up. It
  /// says in coarse steps what an entry costs to compute again.
  struct Lives {
    uint8_t first = 0, most = 1;
  };
  static constexpr int most_lives = 15;
  struct Kind {
    uint16_t tag = 0;  ///< to be told when it is evicted
    Lives lives;
    bool small = false;
  };
  struct Slot {
    uint64_t key = 0;
    uint32_t set = 0, way = 0, version = 0;
    int evicted = -1;  ///< with Found::mine: tag of the entry that had to go, -1 = none
  };
  /// One word of an entry, if it is there and whole. For entries of which little is wanted at a time.
  bool peek(uint64_t key, int word, uint32_t* out) const;
  /// Looks a key up; if it is absent, claims an entry for it. `out` has room for a large entry's words.
  Found find(uint64_t key, uint32_t* out, Slot* slot, const Kind& kind);
  Found find(uint64_t key, uint32_t* out, Slot* slot) { return find(key, out, slot, Kind()); }
  /// Has memory brought nearer that find() is likely to read. Changes nothing.
  void prefetch(uint64_t key) const;
  /// Claims an entry that was found ready, to publish more than it held. False if it has changed since.
  bool reclaim(Slot* slot);
  void publish(const Slot& slot, const uint32_t* words);
  void abandon(const Slot& slot);  ///< forgets the key
  /// Waits for an entry that was pending. False if it has been replaced or abandoned in the meantime.
  bool wait(const Slot& slot, uint32_t* out) const;

  int words() const { return words_; }  ///< of a large entry
  size_t capacity() const { return set_count_ * ways; }
  size_t bytes() const { return set_count_ * set_bytes(); }
  size_t bytes_in_use() const { return used_.load(std::memory_order_relaxed); }
  uint64_t evictions() const { return evictions_.load(std::memory_order_relaxed); }
  /// Bytes an entry costs, its share of the set included.
  static size_t entry_bytes(int words) { return sizeof(Header) / ways + size_t(words) * sizeof(uint32_t); }
  size_t entry_bytes(const Slot& slot) const { return entry_bytes(words_in(slot.way)); }

 private:
  static constexpr uint32_t ways = 16, small_ways = 6;
  struct alignas(64) Header {
    std::atomic<uint64_t> key[ways];  ///< 0 = empty
    std::atomic<uint32_t> version[ways];
    uint16_t tag[ways];                ///< under the lock
    std::atomic<uint8_t> lives[ways];  ///< that are left
    std::atomic<uint32_t> lock;
    uint32_t hand;
    uint16_t
        awaited;  ///< bits of ways that wait for what is being computed for an earlier set of theirs; under the lock

    void revive(uint32_t way, uint8_t most) {
      if (lives[way].load(std::memory_order_relaxed) < most) lives[way].store(most, std::memory_order_relaxed);
    }
  };
  bool is_small(uint32_t way) const { return way >= large_ways_; }
  int words_in(uint32_t way) const { return is_small(way) ? small_words_ : words_; }
  size_t set_words() const { return large_ways_ * size_t(words_) + (ways - large_ways_) * size_t(small_words_); }
  size_t set_bytes() const { return sizeof(Header) + set_words() * sizeof(uint32_t); }

  /// The sets in use: multiples of 2^level, and of those of 2^(level - 1) the ones below split * 2^level. A key belongs
  /// to the last of them that is not after its home.
  struct Growth {
    uint32_t level, split;
  };
  static Growth unpack(uint64_t growth) { return {uint32_t(growth >> 32), uint32_t(growth)}; }
  static uint64_t pack(Growth g) { return uint64_t(g.level) << 32 | g.split; }
  uint64_t home_of(uint64_t key) const { return (key >> 32) * set_count_ >> 32; }
  uint64_t multiples(uint32_t level) const { return ((set_count_ - 1) >> level) + 1; }
  uint32_t place_of(uint64_t set) const;
  uint32_t set_of(uint64_t key) const;
  void grow_if_crowded();
  void split_one(Growth g);
  static void release(Header& h, uint32_t way);
  template <class Do>
  void finish(const Slot& slot, Do what);
  /// The i-th place in a set where a key is looked for.
  static uint32_t way_of(uint64_t key, uint32_t i) { return uint32_t(key + i) % ways; }
  Found look(uint32_t set, uint64_t key, uint32_t* out, Slot* slot, uint8_t lives) const;
  bool claim(uint32_t set, uint64_t key, Slot* slot, const Kind& kind);
  uint32_t choose_victim(Header& h, uint64_t key, bool small) const;
  bool read(uint32_t set, uint32_t way, uint64_t key, uint32_t version, uint32_t* out) const;
  std::atomic<uint32_t>* payload(uint32_t set, uint32_t way) const {
    const size_t in_set = is_small(way) ? large_ways_ * size_t(words_) + (way - large_ways_) * size_t(small_words_)
                                        : way * size_t(words_);
    return &payloads_[set * set_words() + in_set];
  }

  int words_, small_words_;
  uint32_t large_ways_;
  size_t set_count_;
  struct Free {
    void operator()(void* p) const { std::free(p); }
  };
  // All zero bytes are empty entries: pages that no entry came to are never touched.
  std::unique_ptr<std::byte, Free> memory_;
  Header* headers_ = nullptr;
  std::atomic<uint32_t>* payloads_ = nullptr;
  std::atomic<uint64_t> growth_{0};
  std::atomic_flag growing_;
  std::atomic<size_t> used_{0};  ///< bytes; changed by claims, and by abandon() after an exception
  std::atomic<uint64_t> evictions_{0};
};

}  // namespace dapple::gi
