// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/open_origins.h"

#include <bit>
#include <utility>

#include "dapple/distribution/cache_numbers.h"
#include "dapple/integrate/ray_origin.h"
#include "dapple/numeric/warp.h"

namespace dapple::distribution {

using integrate::PointBatch;
using integrate::RayOrigin;

void OpenOrigins::keep(PointBatch& b, const bool* wanted, ShadingWorkspace& w) const {
  int first = 0, rays = 0;
  for (int k = 0; k < b.count; ++k) {
    if (rays + PointBatch::most_origins > trace::RayBatch::capacity)
      trace(std::exchange(first, k), k, b, wanted, w), rays = 0;
    rays += b.origins[k];
  }
  trace(first, b.count, b, wanted, w);
}

// Straight away first, since corners are open to readers on both their sides; what something stands before, as under a
// table, may be open to a side.
void OpenOrigins::trace(int first, int end, PointBatch& b, const bool* wanted, ShadingWorkspace& w) const {
  int place[trace::RayBatch::capacity], n = 0;
  uint32_t open[PointBatch::capacity] = {};
  for (int k = first; k < end; ++k)
    for (int o = 0; wanted[k] && o < b.origins[k]; ++o) place[n++] = k * PointBatch::most_origins + o;
  for (const bool straight : {true, false}) {
    if (n == 0) break;
    for (int i = 0; i < n; ++i) {
      const int k = place[i] / PointBatch::most_origins, o = place[i] % PointBatch::most_origins;
      const RayOrigin& from = b.origin[place[i]];
      const uint32_t seed = seed_of(b.key[k], Purpose::openness);
      const V3f normal = dot(b.wo[k], b.surface[k].Ng) < 0 ? -from.Ng : from.Ng;
      const V3f d =
          straight ? normal : Frame(normal).to_world(square_to_cosine_hemisphere(sample_2d(seed, uint32_t(o), 0)));
      w.shadow.set(i, integrate::offset_origin(from, d), d, CacheNumbers::open_widths * b.width[k], from.time,
                   trace::ray_key(seed, uint32_t(o)), b.width[k], 0);
      w.shadow_medium[i] = scene::vacuum;
    }
    tracer_.visible(w.shadow, n, w.shadow_medium, w.visible, w.tracing);
    w.rays.link += uint64_t(n);
    int blocked = 0;
    for (int i = 0; i < n; ++i) {
      if (w.visible[i].max() >= 0.5f)
        open[place[i] / PointBatch::most_origins] |= 1u << place[i] % PointBatch::most_origins;
      else
        place[blocked++] = place[i];
    }
    n = blocked;
  }
  for (int k = first; k < end; ++k)
    if (wanted[k]) replace_closed(open[k], k, b);
}

void OpenOrigins::replace_closed(uint32_t open, int k, PointBatch& b) {
  const int all = b.origins[k], count = std::popcount(open);
  if (count == 0 || count == all) return;
  RayOrigin* const origin = b.origin + k * PointBatch::most_origins;
  // From a place of its own in each cell: else one corner of all of them would count most.
  auto from = int(random_of(b.key[k], Purpose::openness, 0) % uint64_t(all));
  for (int o = 0; o < all; ++o) {
    if (open >> o & 1) continue;
    while (!(open >> from & 1)) from = (from + 1) % all;
    origin[o] = origin[from];
    from = (from + 1) % all;
  }
}

}  // namespace dapple::distribution
