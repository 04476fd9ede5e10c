// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/grid_store.h"

namespace dapple::integrate {

namespace {
constexpr size_t node_bytes = 2 * sizeof(void*) + sizeof(scene::GridId) + sizeof(void*) + 16;  // of the map, about
}

size_t ShadingGrid::bytes() const {
  const size_t points = size_t(id.count());
  return sizeof(ShadingGrid) + node_bytes + points * (sizeof(RGB) + (bsdf ? sizeof(shading::Bsdf) : 0));
}

GridStore::Claim GridStore::claim(const scene::GridId& id) {
  Shard& shard = shards_[id.hash() >> 58];
  static_assert(shard_count == 1 << (64 - 58));
  const std::lock_guard lock(shard.mutex);
  if (const auto found = shard.grids.find(id); found != shard.grids.end()) return {found->second.get(), false};
  if (bytes_ >= max_bytes_) return {nullptr, true};
  auto grid = std::make_unique<ShadingGrid>(id);
  grid->kept = true;
  ShadingGrid* const p = grid.get();
  shard.grids.emplace(id, std::move(grid));
  return {p, true};
}

void GridStore::publish(ShadingGrid& grid) {
  if (grid.kept) bytes_ += grid.bytes();
  grid.ready.store(true, std::memory_order_release);
  grid.ready.notify_all();
}

}  // namespace dapple::integrate
