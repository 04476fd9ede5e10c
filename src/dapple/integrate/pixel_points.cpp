// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/pixel_points.h"

#include "dapple/base/hash.h"

namespace dapple::integrate {

bool PixelPoints::lend(const scene::Scene& scene, int pixel, int enough, uint64_t key, scene::GridPoint* point, GridStore::GridPtr* grid) const {
  const std::vector<Seen>& seen = seen_[pixel];
  if (seen.size() < size_t(enough)) return false;
  const scene::GridId id = point->grid;
  const int32_t material = scene.bindings[id.geometry].material;
  uint64_t count = 0;
  for (const Seen& s : seen) {
    if (s.point.grid.behind != id.behind || scene.bindings[s.point.grid.geometry].material != material) continue;
    // Itself, else any with the same chance.
    const bool same = s.point.grid == id;
    ++count;
    if (!same && hash(key, count) % count != 0) continue;
    *point = s.point;
    *grid = s.grid;
    if (same) break;
  }
  return count > 0;
}

}  // namespace dapple::integrate
