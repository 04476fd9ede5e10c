// SPDX-License-Identifier: Apache-2.0
#include "dapple/gi/tile_cache.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <thread>
#include <vector>

#include "dapple/base/hash.h"

namespace dapple::gi {
namespace {

using Found = TileCache::Found;
constexpr int words = 6;
using Entry = std::array<uint32_t, words>;

// What an entry is to hold: a function of its key.
void compute(uint64_t key, Entry* out) {
  for (uint32_t i = 0; i < words; ++i) (*out)[i] = uint32_t(hash(key, i));
}
bool holds(uint64_t key, const Entry& entry) {
  Entry expected;
  compute(key, &expected);
  return std::equal(entry.begin(), entry.begin() + words, expected.begin());
}

TEST(TileCache, GivesBackWhatWasPublished) {
  TileCache cache(1 << 16, words);
  Entry entry;
  TileCache::Slot slot;
  ASSERT_EQ(cache.find(42, entry.data(), &slot), Found::mine);
  TileCache::Slot other;
  EXPECT_EQ(cache.find(42, entry.data(), &other), Found::pending);
  compute(42, &entry);
  cache.publish(slot, entry.data());
  entry = {};
  ASSERT_EQ(cache.find(42, entry.data(), &other), Found::ready);
  EXPECT_TRUE(holds(42, entry));
  entry = {};
  EXPECT_TRUE(cache.wait(slot, entry.data()));
  EXPECT_TRUE(holds(42, entry));
}

TEST(TileCache, PeeksAtWordsOfWholeEntriesAlone) {
  TileCache cache(1 << 16, words);
  Entry entry;
  TileCache::Slot slot;
  uint32_t word = 0;
  EXPECT_FALSE(cache.peek(42, 3, &word));
  EXPECT_EQ(cache.bytes_in_use(), 0u);
  ASSERT_EQ(cache.find(42, entry.data(), &slot), Found::mine);
  EXPECT_FALSE(cache.peek(42, 3, &word)) << "not computed yet";
  compute(42, &entry);
  cache.publish(slot, entry.data());
  for (int i = 0; i < words; ++i) {
    ASSERT_TRUE(cache.peek(42, i, &word));
    EXPECT_EQ(word, entry[size_t(i)]);
  }
  EXPECT_FALSE(TileCache(0, words).peek(42, 0, &word));
}

TEST(TileCache, ForgetsWhatWasAbandoned) {
  TileCache cache(1 << 16, words);
  Entry entry;
  TileCache::Slot slot, again;
  ASSERT_EQ(cache.find(7, entry.data(), &slot), Found::mine);
  cache.abandon(slot);
  EXPECT_EQ(cache.bytes_in_use(), 0u);
  EXPECT_FALSE(cache.wait(slot, entry.data()));
  EXPECT_EQ(cache.find(7, entry.data(), &again), Found::mine);
}

TEST(TileCache, KeepsNothingWithoutMemory) {
  TileCache cache(100, words);
  Entry entry;
  TileCache::Slot slot;
  EXPECT_EQ(cache.bytes(), 0u);
  EXPECT_EQ(cache.find(1, entry.data(), &slot), Found::refused);
}

TEST(TileCache, StaysWithinItsMemory) {
  constexpr size_t bytes = 100000;
  TileCache cache(bytes, words);
  EXPECT_LE(cache.bytes(), bytes);
  EXPECT_GT(cache.bytes(), bytes * 98 / 100);
  for (uint64_t key = 1; key < 20000; ++key) {
    Entry entry;
    TileCache::Slot slot;
    ASSERT_EQ(cache.find(hash(key), entry.data(), &slot), Found::mine);
    compute(hash(key), &entry);
    cache.publish(slot, entry.data());
    ASSERT_LE(cache.bytes_in_use(), cache.bytes());
  }
  EXPECT_EQ(cache.bytes_in_use(), cache.capacity() * TileCache::entry_bytes(words));
  EXPECT_EQ(cache.evictions(), 19999 - cache.capacity());
}

// Memory is taken into use as entries come: all that a large cache was given is found again, at whatever size it grew
// to.
TEST(TileCache, GrowsWithoutLosing) {
  for (const size_t bytes : {size_t(3) << 20, size_t(10) << 20, size_t(64) << 20}) {
    TileCache cache(bytes, words);
    const uint64_t most = cache.capacity() / 8;  // so few that no set is full
    for (uint64_t key = 0; key < most; ++key) {
      Entry entry;
      TileCache::Slot slot;
      ASSERT_EQ(cache.find(hash(key), entry.data(), &slot), Found::mine);
      compute(hash(key), &entry);
      cache.publish(slot, entry.data());
      const uint64_t other = hash(key, 1) % (key + 1);
      ASSERT_EQ(cache.find(hash(other), entry.data(), &slot), Found::ready) << key << " of " << most << ", " << other;
      ASSERT_TRUE(holds(hash(other), entry));
    }
    EXPECT_EQ(cache.evictions(), 0u);
    EXPECT_EQ(cache.bytes_in_use(), most * TileCache::entry_bytes(words));
  }
}

// Entries that are being computed while the cache grows are pending wherever they belong, and found there in the end;
// what has been abandoned is not.
TEST(TileCache, GrowsAroundWhatIsBeingComputed) {
  TileCache cache(size_t(8) << 20, words);
  constexpr uint64_t count = 3000;
  const auto name = [](uint64_t i) { return hash(i, 77); };
  std::vector<TileCache::Slot> slots(count);
  Entry entry;
  TileCache::Slot slot;
  for (uint64_t i = 0; i < count; ++i) ASSERT_EQ(cache.find(name(i), entry.data(), &slots[i]), Found::mine);
  const auto flood = [&](uint64_t first) {
    for (uint64_t key = first; key < first + 10000; ++key)
      if (cache.find(hash(key), entry.data(), &slot) == Found::mine) cache.publish(slot, entry.data());
  };
  const auto finish = [&](uint64_t i) {
    compute(name(i), &entry);
    if (i % 3 == 0)
      cache.abandon(slots[i]);
    else
      cache.publish(slots[i], entry.data());
  };
  for (uint64_t step = 0; step < 3; ++step) {
    flood(10000 * step);
    for (uint64_t i = 0; i < count; ++i) {
      ASSERT_TRUE(i < step * 1000 || cache.find(name(i), entry.data(), &slot) == Found::pending);
      if (i / 1000 == step) finish(i);
    }
  }
  flood(30000);
  uint64_t kept = 0;
  for (uint64_t i = 0; i < count; ++i) {
    EXPECT_TRUE(!cache.wait(slots[i], entry.data()) || holds(name(i), entry));
    const Found found = cache.find(name(i), entry.data(), &slot);
    kept += found == Found::ready;
    EXPECT_TRUE(found != Found::ready || (holds(name(i), entry) && i % 3 != 0));
    if (found == Found::mine) cache.abandon(slot);
  }
  EXPECT_GE(kept, count * 2 / 3 - cache.evictions());
  EXPECT_LT(cache.evictions(), 20u);
  // No way is reserved for ever: all memory can be claimed.
  for (uint64_t key = 0; key < 20 * cache.capacity(); ++key)
    if (cache.find(hash(key, 5), entry.data(), &slot) == Found::mine) cache.publish(slot, entry.data());
  EXPECT_EQ(cache.bytes_in_use(), cache.capacity() * TileCache::entry_bytes(words));
}

size_t resident_bytes() {
  size_t size = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> size >> resident;
  return resident * size_t(sysconf(_SC_PAGESIZE));
}

TEST(TileCache, TouchesMemoryInProportionToWhatItHolds) {
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "sanitizers keep memory of their own";
#endif
  TileCache cache(size_t(1) << 30, words);
  const size_t before = resident_bytes();
  constexpr uint64_t count = 20000;
  for (uint64_t key = 0; key < count; ++key) {
    Entry entry{};
    TileCache::Slot slot;
    ASSERT_EQ(cache.find(hash(key), entry.data(), &slot), Found::mine);
    cache.publish(slot, entry.data());
  }
  EXPECT_LT(resident_bytes() - before, (size_t(2) << 20) + 20 * count * TileCache::entry_bytes(words));
}

// An entry that is looked up again and again outlives a flood of others.
TEST(TileCache, KeepsWhatIsUsed) {
  TileCache cache(100000, words);
  Entry entry;
  TileCache::Slot slot;
  cache.find(hash(0), entry.data(), &slot);
  compute(hash(0), &entry);
  cache.publish(slot, entry.data());
  int lost = 0;
  for (uint64_t key = 1; key < 20000; ++key) {
    for (const uint64_t k : {hash(uint64_t(0)), hash(key)})
      if (cache.find(k, entry.data(), &slot) == Found::mine) {
        lost += k == hash(uint64_t(0));
        compute(k, &entry);
        cache.publish(slot, entry.data());
      }
  }
  EXPECT_EQ(lost, 0);
}

// Lives: what is dear outlives a flood in which what is cheap and as often used goes, and goes in the end too.
TEST(TileCache, KeepsWhatHasMoreLivesLonger) {
  const auto count_kept = [](TileCache::Lives lives, int flood) {
    TileCache cache(20000, words);
    Entry entry{};
    TileCache::Slot slot;
    const auto look_up = [&](uint64_t key, TileCache::Lives l) {
      const Found found = cache.find(hash(key), entry.data(), &slot, {.lives = l});
      if (found == Found::mine) cache.publish(slot, entry.data());
      return found == Found::ready;
    };
    constexpr uint64_t old = 100;
    for (uint64_t key = 0; key < old; ++key) look_up(key, lives), look_up(key, lives);
    for (uint64_t key = old; key < old + uint64_t(flood); ++key) look_up(key, {0, 1});
    int kept = 0;
    for (uint64_t key = 0; key < old; ++key) {
      uint32_t word;
      kept += cache.peek(hash(key), 0, &word);
    }
    return kept;
  };
  const int capacity = int(TileCache(20000, words).capacity());
  EXPECT_LT(count_kept({0, 1}, 3 * capacity), 10);
  EXPECT_GT(count_kept({3, 7}, 3 * capacity), 90);
  EXPECT_LT(count_kept({3, 7}, 20 * capacity), 10);
}

TEST(TileCache, ReclaimedEntriesAreAddedTo) {
  TileCache cache(1 << 16, words);
  Entry entry;
  TileCache::Slot slot, same, other;
  ASSERT_EQ(cache.find(42, entry.data(), &slot), Found::mine);
  compute(42, &entry);
  entry[1] = 0;
  cache.publish(slot, entry.data());
  ASSERT_EQ(cache.find(42, entry.data(), &slot), Found::ready);
  same = slot;
  ASSERT_TRUE(cache.reclaim(&slot));
  EXPECT_FALSE(cache.reclaim(&same)) << "another has it";
  EXPECT_EQ(cache.find(42, entry.data(), &other), Found::pending);
  compute(42, &entry);
  cache.publish(slot, entry.data());
  EXPECT_FALSE(cache.reclaim(&same)) << "it has changed";
  entry = {};
  ASSERT_EQ(cache.find(42, entry.data(), &other), Found::ready);
  EXPECT_TRUE(holds(42, entry));
  EXPECT_EQ(cache.evictions(), 0u);
  EXPECT_EQ(cache.bytes_in_use(), TileCache::entry_bytes(words));
}

// Threads that want the same few keys, in a cache too small for them, and in one that grows meanwhile: whatever is read
// is whole and right.
class TileCacheThreads : public testing::TestWithParam<std::pair<size_t, uint64_t>> {};

TEST_P(TileCacheThreads, ReadWhatIsWholeAndRight) {
  const auto [bytes, keys] = GetParam();
  TileCache cache(bytes, words);
  ASSERT_GT(cache.capacity(), 0u);
  std::atomic<int> wrong{0};
  const auto work = [&, keys = keys](uint64_t seed) {
    KeyedRng rng(seed);
    for (int i = 0; i < 50000; ++i) {
      const uint64_t key = hash(rng.next_bits() % keys);
      Entry entry{};
      TileCache::Slot slot;
      switch (cache.find(key, entry.data(), &slot)) {
        case Found::ready:
          wrong += !holds(key, entry);
          if (rng.next() < 0.1f && cache.reclaim(&slot)) cache.publish(slot, entry.data());
          break;
        case Found::mine:
          compute(key, &entry);
          if (rng.next() < 0.1f)
            cache.abandon(slot);
          else
            cache.publish(slot, entry.data());
          break;
        case Found::pending:
          if (cache.wait(slot, entry.data())) wrong += !holds(key, entry);
          break;
        case Found::refused:
          break;
      }
    }
  };
  std::vector<std::thread> threads;
  for (uint64_t t = 0; t < 4; ++t) threads.emplace_back(work, t);
  for (std::thread& t : threads) t.join();
  EXPECT_EQ(wrong, 0);
}

INSTANTIATE_TEST_SUITE_P(Sizes, TileCacheThreads,
                         testing::Values(std::pair(size_t(4096), uint64_t(200)),
                                         std::pair(size_t(8) << 20, uint64_t(40000))));

}  // namespace
}  // namespace dapple::gi
