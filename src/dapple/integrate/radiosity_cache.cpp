// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/radiosity_cache.h"

#include <cstring>

#include "dapple/gi/packed_radiance.h"
#include "dapple/scene/light_groups.h"

namespace dapple::integrate {

namespace {
constexpr int coarse_level = 2, medium_level = 6;  // log2 of the points of a patch, at most
constexpr size_t value_bytes = 6;

void store(const RGB& value, std::byte* to) {
  const uint16_t packed[3] = {gi::pack(value.r), gi::pack(value.g), gi::pack(value.b)};
  std::memcpy(to, packed, value_bytes);
}

RGB load(const std::byte* from) {
  uint16_t packed[3];
  std::memcpy(packed, from, value_bytes);
  return {gi::unpack(packed[0]), gi::unpack(packed[1]), gi::unpack(packed[2])};
}
}  // namespace

RadiosityCache::RadiosityCache(size_t bytes, int groups)
    : areas_{{bytes / 4, words(1 << coarse_level, groups)},
             {bytes / 4, words(max_points, groups)},
             {bytes / 2, words(max_points, groups)}} {}

Resolution RadiosityCache::resolution(const scene::GridId& grid) {
  const int level = grid.u_level + grid.v_level;
  return level <= coarse_level ? Resolution::coarse : level <= medium_level ? Resolution::medium : Resolution::fine;
}

void RadiosityCache::find(Entry& e, Counts* counts) {
  e.found = area(e).find(e.key, e.words, &e.slot, uint8_t(e.diffuse_depth));
  const bool hit = e.found == gi::TileCache::Found::ready || e.found == gi::TileCache::Found::pending;
  counts->add(e, {1, hit, !hit, 0});
  if (e.found == gi::TileCache::Found::mine) count_memory(e, counts);
  if (!hit) std::fill_n(e.words, area(e).words(), 0u);  // points outside the patch are not computed
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

void RadiosityCache::Entry::set_links(const TileLinks& links) { words[0] = links.divided, words[1] = links.cut; }

TileLinks RadiosityCache::Entry::links() const { return {words[0], words[1]}; }

// Links first, then points: each the sum, then its parts.
void RadiosityCache::Entry::set(int point, const LightParts& value) {
  std::byte* to = reinterpret_cast<std::byte*>(words + TileLinks::words) + size_t(point * (1 + groups)) * value_bytes;
  store(value.sum, to);
  for (int g = 0; g < groups; ++g) store(value.parts[g], to += value_bytes);
}

void RadiosityCache::Entry::add_to(LightSums& sums, int i, int point, float weight) const {
  const std::byte* from = reinterpret_cast<const std::byte*>(words + TileLinks::words) + size_t(point * (1 + groups)) * value_bytes;
  const RGB value = load(from);
  if (groups == 0) return sums.add(i, RGB(weight), {value});
  RGB parts[scene::LightGroups::max_count];
  for (int g = 0; g < groups; ++g) parts[g] = load(from += value_bytes);
  share_out(value, {parts, size_t(groups)});  // each was rounded by itself
  sums.add(i, RGB(weight), {value, parts});
}

}  // namespace dapple::integrate
