// SPDX-License-Identifier: Apache-2.0
#include "dapple/gi/radiosity_cache.h"

#include <cstring>

#include "dapple/gi/packed_radiance.h"
#include "dapple/scene/light_groups.h"

namespace dapple::gi {

using integrate::CacheCounts;
using integrate::CacheState;
using integrate::LightParts;
using integrate::LightSums;
using integrate::Resolution;
using integrate::resolution_count;
using integrate::share_out;
using Found = TileCache::Found;

namespace {
constexpr int coarse_level = 2, medium_level = 6;  // log2 of the points of a patch, at most
constexpr size_t value_bytes = 6;

void store(const RGB& value, std::byte* to) {
  const uint16_t packed[3] = {pack(value.r), pack(value.g), pack(value.b)};
  std::memcpy(to, packed, value_bytes);
}

RGB load(const std::byte* from) {
  uint16_t packed[3];
  std::memcpy(packed, from, value_bytes);
  return {unpack(packed[0]), unpack(packed[1]), unpack(packed[2])};
}

static_assert(TileLinks::most_parts + RadiosityCache::max_points <= 32);

// Bounces cost more, the fewer lie before them: each asks for many of the next.
constexpr TileCache::Lives lives(int diffuse_depth) {
  if (diffuse_depth <= 1) return {3, 7};
  return {0, 2};
}
}  // namespace

RadiosityCache::RadiosityCache(size_t bytes, int groups)
    : cache_(bytes, words(max_points, groups), words(1 << coarse_level, groups)) {}

Resolution RadiosityCache::resolution(const scene::GridId& grid) {
  const int level = grid.u_level + grid.v_level;
  return level <= coarse_level ? Resolution::coarse : level <= medium_level ? Resolution::medium : Resolution::fine;
}

void RadiosityCache::find(Entry& e, Counts* counts) {
  const Resolution r = resolution(e.grid);
  const TileCache::Kind kind{uint16_t(e.diffuse_depth * resolution_count + int(r)), lives(e.diffuse_depth),
                             r == Resolution::coarse};
  do {
    e.found = cache_.find(e.key, e.words, &e.slot, kind);
    if (e.found == Found::ready && e.missing() == 0) return;
    if (e.found == Found::ready && cache_.reclaim(&e.slot)) {
      e.found = Found::mine;
      return;
    }
  } while (e.found == Found::ready);
  if (e.found == Found::mine) count_memory(e, counts);
  e.clear();
}

void RadiosityCache::publish(Entry& e) {
  cache_.publish(e.slot, e.words);
  e.found = Found::ready;
}

bool RadiosityCache::wait(Entry& e) {
  if (cache_.wait(e.slot, e.words) && e.missing() == 0) {
    e.found = Found::ready;
    return true;
  }
  e.clear();
  return false;
}

void RadiosityCache::abandon(const Entry& e) {
  cache_.abandon(e.slot);
  use_[size_t(resolution(e.grid))].bytes.fetch_sub(cache_.entry_bytes(e.slot), std::memory_order_relaxed);
}

// An entry comes, and another may have to go, of any resolution and depth.
void RadiosityCache::count_memory(const Entry& e, Counts* counts) {
  const size_t bytes = cache_.entry_bytes(e.slot);
  use_[size_t(resolution(e.grid))].bytes.fetch_add(bytes, std::memory_order_relaxed);
  counts->by_depth[size_t(e.diffuse_depth)].bytes += int64_t(bytes);
  if (e.slot.evicted < 0) return;
  Use& gone = use_[e.slot.evicted % resolution_count];
  gone.bytes.fetch_sub(bytes, std::memory_order_relaxed);
  gone.evictions.fetch_add(1, std::memory_order_relaxed);
  CacheCounts& of_depth = counts->by_depth[size_t(e.slot.evicted / resolution_count)];
  ++of_depth.evictions;
  of_depth.bytes -= int64_t(bytes);
}

CacheState RadiosityCache::state(Resolution r) const {
  const Use& use = use_[size_t(r)];
  CacheState s;
  s.evictions = use.evictions.load(std::memory_order_relaxed);
  // Entries are replaced, and given up after an exception only: of all together, the peak is what is in use.
  s.bytes = s.peak_bytes = s.capacity_bytes = use.bytes.load(std::memory_order_relaxed);
  if (r == Resolution::fine) s.capacity_bytes += cache_.bytes() - cache_.bytes_in_use();
  return s;
}

void RadiosityCache::Entry::set_links(const TileLinks& links) {
  words[0] = (words[0] & ~TileLinks::all_parts) | links.divided;
  words[1] = links.cut;
}

// Links first, then points: each the sum, then its parts.
std::byte* RadiosityCache::Entry::values(int point) const {
  return reinterpret_cast<std::byte*>(words + TileLinks::words) + size_t(point * (1 + groups)) * value_bytes;
}

void RadiosityCache::Entry::set(int point, const LightParts& value) {
  std::byte* to = values(point);
  store(value.sum, to);
  for (int g = 0; g < groups; ++g) store(value.parts[g], to += value_bytes);
  set_known(point);
}

void RadiosityCache::Entry::set_black(int point) {
  std::memset(values(point), 0, size_t(1 + groups) * value_bytes);
  set_known(point);
}

void RadiosityCache::Entry::add_to(LightSums& sums, int i, int point, float weight) const {
  const std::byte* from = values(point);
  const RGB value = load(from);
  if (groups == 0) return sums.add(i, RGB(weight), {value});
  RGB parts[scene::LightGroups::max_count];
  for (int g = 0; g < groups; ++g) parts[g] = load(from += value_bytes);
  share_out(value, {parts, size_t(groups)});  // each was rounded by itself
  sums.add(i, RGB(weight), {value, parts});
}

}  // namespace dapple::gi
