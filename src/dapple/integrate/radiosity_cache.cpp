// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/radiosity_cache.h"

#include <cstring>

#include "dapple/gi/packed_radiance.h"

namespace dapple::integrate {

namespace {
constexpr int coarse_level = 2, medium_level = 6;  // log2 of the points of a patch, at most
// Links first, then points.
constexpr int words_of(int points) { return TileLinks::words + points * 3 / 2; }
static_assert(words_of(RadiosityCache::max_points) <= gi::TileCache::max_words);
}  // namespace

RadiosityCache::RadiosityCache(size_t bytes)
    : areas_{{bytes / 4, words_of(1 << coarse_level)}, {bytes / 4, words_of(max_points)}, {bytes / 2, words_of(max_points)}} {}

Resolution RadiosityCache::resolution(const scene::GridId& grid) {
  const int level = grid.u_level + grid.v_level;
  return level <= coarse_level ? Resolution::coarse : level <= medium_level ? Resolution::medium : Resolution::fine;
}

void RadiosityCache::find(Entry& e, Counts* counts) {
  e.found = area(e).find(e.key, e.words, &e.slot, uint8_t(e.diffuse_depth));
  const bool hit = e.found == gi::TileCache::Found::ready || e.found == gi::TileCache::Found::pending;
  counts->add(e, {1, hit, !hit, 0});
  if (e.found == gi::TileCache::Found::mine) count_memory(e, counts);
  if (!hit) std::memset(e.words, 0, sizeof e.words);  // points outside the patch are not computed
}

// An entry comes, and another may have to go, of any depth.
void RadiosityCache::count_memory(const Entry& e, Counts* counts) {
  const int64_t bytes = int64_t(gi::TileCache::entry_bytes(area(e).words()));
  counts->by_depth[size_t(e.diffuse_depth)].bytes += bytes;
  if (e.slot.evicted < 0) return;
  CacheCounts& gone = counts->by_depth[size_t(e.slot.evicted)];
  ++gone.evictions;
  gone.bytes -= bytes;
}

void RadiosityCache::Entry::set(int point, const RGB& value) {
  const uint16_t packed[3] = {gi::pack(value.r), gi::pack(value.g), gi::pack(value.b)};
  std::memcpy(reinterpret_cast<std::byte*>(words + TileLinks::words) + point * 6, packed, 6);
}

void RadiosityCache::Entry::set_links(const TileLinks& links) { words[0] = links.divided, words[1] = links.cut; }

TileLinks RadiosityCache::Entry::links() const { return {words[0], words[1]}; }

RGB RadiosityCache::Entry::get(int point) const {
  uint16_t packed[3];
  std::memcpy(packed, reinterpret_cast<const std::byte*>(words + TileLinks::words) + point * 6, 6);
  return {gi::unpack(packed[0]), gi::unpack(packed[1]), gi::unpack(packed[2])};
}

}  // namespace dapple::integrate
