// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/grid_store.h"

#include <utility>

namespace dapple::distribution {

using integrate::CacheState;

namespace {
// Of the bucket, the queue and the reference counts, about.
constexpr size_t overhead = 3 * sizeof(GridStore::GridPtr) + 32;
}  // namespace

size_t ShadingGrid::bytes() const {
  return sizeof(ShadingGrid) + overhead +
         size_t(id.count()) * (sizeof(RGB) * size_t(1 + groups) + (bsdf ? sizeof(scattering::Bsdf) : 0));
}

void GridStore::Shard::insert(const GridPtr& grid) {
  if (queue.size() >= buckets.size()) {
    buckets.assign(2 * buckets.size(), nullptr);
    for (const GridPtr& known : queue) known->next = std::exchange(bucket(known->hash), known);
  }
  grid->next = std::exchange(bucket(grid->hash), grid);
  queue.push_back(grid);
}

void GridStore::Shard::erase(const ShadingGrid& grid) {
  GridPtr* at = &bucket(grid.hash);
  while (at->get() != &grid) at = &(*at)->next;
  *at = GridPtr(std::move((*at)->next));
}

GridStore::Claim GridStore::claim(const scene::GridId& id, bool with_bsdf) {
  const uint64_t hash = id.hash();
  Shard& shard = shards_[hash >> 58];
  static_assert(shard_count == 1 << (64 - 58));
  const std::lock_guard lock(shard.mutex);
  for (const GridPtr* grid = &shard.bucket(hash); *grid; grid = &(*grid)->next)
    if ((*grid)->hash == hash && (*grid)->id == id) {
      (*grid)->recent = true;
      return {*grid, false};
    }
  make_room(shard);
  auto grid = std::make_shared<ShadingGrid>(id, hash, groups_, with_bsdf);
  grid->claimed = ShadingGrid::linked;
  shard.insert(grid);
  shard.bytes += grid->bytes();
  const size_t bytes = bytes_ += grid->bytes();
  size_t peak = peak_bytes_;
  while (peak < bytes && !peak_bytes_.compare_exchange_weak(peak, bytes)) {
  }
  return {std::move(grid), true};
}

// Those that are being shaded are not dropped.
void GridStore::make_room(Shard& shard) {
  for (size_t looked_at = 2 * shard.queue.size(); shard.bytes > max_bytes_ / shard_count && looked_at > 0;
       --looked_at) {
    GridPtr oldest = std::move(shard.queue.front());
    shard.queue.pop_front();
    if (oldest->recent || oldest->ready != oldest->claimed) {
      oldest->recent = false;
      shard.queue.push_back(std::move(oldest));
      continue;
    }
    shard.bytes -= oldest->bytes();
    bytes_ -= oldest->bytes();
    ++evictions_;
    shard.erase(*oldest);
  }
}

void GridStore::clear() {
  for (Shard& shard : shards_) {
    const std::lock_guard lock(shard.mutex);
    shard.buckets.assign(16, nullptr);
    for (const GridPtr& grid : shard.queue) grid->next.reset();
    shard.queue.clear();
    shard.bytes = 0;
  }
  bytes_ = 0;
}

CacheState GridStore::state() const {
  return {"grids", {}, evictions_, bytes_, peak_bytes_, max_bytes_};
}

}  // namespace dapple::distribution
