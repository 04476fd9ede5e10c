// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/pixel_points.h"

#include "dapple/base/hash.h"

namespace dapple::distribution {

using integrate::CameraBatch;

namespace {
bool alike(const scene::Scene& scene, const scene::GridId& a, const scene::GridId& b) {
  return a.behind == b.behind && scene.bindings[a.geometry].material == scene.bindings[b.geometry].material;
}
}  // namespace

void PixelPoints::clear() {
  std::fill_n(count_, CameraBatch::capacity, 0);
  in_block_.clear();
}

void PixelPoints::consider(const scene::Scene& scene, int pixel, int enough, const scene::GridPoint& point) {
  int& count = count_[pixel];
  bool some_alike = false;
  for (const scene::GridPoint *c = chosen_[pixel], *end = c + count; c < end; ++c) {
    if (c->grid == point.grid) return;
    some_alike |= alike(scene, c->grid, point.grid);
  }
  if ((count >= enough && some_alike) || count == int(GridNumbers::first_samples)) return;
  chosen_[pixel][count++] = point;
  if (point.grid.count() == 1) in_block_.push_back(point.grid.hash());
}

void PixelPoints::lend(const scene::Scene& scene, int pixel, int enough, uint64_t key, scene::GridPoint* point) const {
  if (count_[pixel] < enough) return;
  const scene::GridId own = point->grid;
  // Of a patch of several points, it might ask for others than those that are shaded.
  if (own.count() == 1 && std::binary_search(in_block_.begin(), in_block_.end(), own.hash())) return;
  uint64_t alike_so_far = 0;
  for (const scene::GridPoint *c = chosen_[pixel], *end = c + count_[pixel]; c < end; ++c) {
    if (!alike(scene, c->grid, own)) continue;
    ++alike_so_far;
    if (hash(key, alike_so_far) % alike_so_far == 0) *point = *c;
  }
}

}  // namespace dapple::distribution
