// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/open_origins.h"

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

void OpenOrigins::trace(int first, int end, PointBatch& b, const bool* wanted, ShadingWorkspace& w) const {
  int n = 0;
  for (int k = first; k < end; ++k) {
    if (!wanted[k]) continue;
    const uint32_t seed = seed_of(b.key[k], Purpose::openness);
    for (int o = 0; o < b.origins[k]; ++o, ++n) {
      const RayOrigin& from = b.origin[k * PointBatch::most_origins + o];
      const V3f normal = dot(b.wo[k], b.surface[k].Ng) < 0 ? -from.Ng : from.Ng;
      const V3f d = Frame(normal).to_world(square_to_cosine_hemisphere(sample_2d(seed, uint32_t(o), 0)));
      w.shadow.set(n, integrate::offset_origin(from, d), d, CacheNumbers::open_widths * b.width[k], from.time,
                   trace::ray_key(seed, uint32_t(o)), b.width[k], 0);
      w.shadow_medium[n] = scene::vacuum;
    }
  }
  if (n == 0) return;
  tracer_.visible(w.shadow, n, w.shadow_medium, w.visible, w.tracing);
  w.rays.link += uint64_t(n);
  n = 0;
  for (int k = first; k < end; ++k) {
    if (!wanted[k]) continue;
    RayOrigin* const origin = b.origin + k * PointBatch::most_origins;
    int open[PointBatch::most_origins], count = 0;
    for (int o = 0; o < b.origins[k]; ++o)
      if (w.visible[n++].max() >= 0.5f) open[count++] = o;
    if (count == 0 || count == b.origins[k]) continue;
    RayOrigin kept[PointBatch::most_origins];
    for (int o = 0; o < count; ++o) kept[o] = origin[open[o]];
    int next = 0;
    for (int o = 0, at = 0; o < b.origins[k]; ++o) {
      if (at < count && open[at] == o)
        ++at;
      else
        origin[o] = kept[next++ % count];
    }
  }
}

}  // namespace dapple::distribution
