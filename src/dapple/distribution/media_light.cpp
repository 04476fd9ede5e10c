// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/media_light.h"

#include "dapple/distribution/cache_numbers.h"
#include "dapple/distribution/camera_samples.h"

namespace dapple::distribution {

using integrate::PointBatch;
using integrate::RaySet;

void MediaLight::shade(const Place& place, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  RaySet& r = b.ray_set(0);
  b.Ci.clear_all(b.count);
  // Scatterings of camera rays themselves.
  const light::ShaftLight* const shafts = place.level == sample_level ? shading_.settings.shafts.get() : nullptr;
  shading_.direct.light_media(b, place.list_depth(), shafts, w);
  if (place.depth.specular >= shading_.settings.specular_depth) return;
  for (int k = 0; k < b.count; ++k) w.seed[k] = uint32_t(random_of(b.key[k], Purpose::phase)), w.index[k] = 0;
  w.draw_samples(b.count);
  for (int k = 0; k < b.count; ++k) {
    V3f d;
    const float pdf = shading_.scene.media[size_t(b.medium[k])]->phase().sample(b.wo[k], V2f(w.u0[k], w.u1[k]), &d);
    r.point[k] = k;
    r.sequence[k] = b.key[k];
    r.number[k] = 0;
    r.weight[k] = RGB(1);
    r.cone[k] = std::max(b.spread[k], std::min(CacheNumbers::widest_cone, 1 / std::sqrt(pdf * float(b.share[k]))));
    r.spread[k] = std::max(b.spread[k], std::min(GridNumbers::widest_spread, r.cone[k]));
    r.share[k] = b.share[k];
    r.throughput[k] = b.throughput[k];
    r.medium[k] = b.medium[k];
    r.wavelength[k] = b.wavelength[k];
    r.rays.set(k, b.surface[k].P, d, infinity, b.time[k], w.seed[k], b.width[k], r.spread[k]);
  }
  r.count = b.count;
  w.rays.specular += uint64_t(r.count);
  shading_.trace(r, w);
  r.L.clear_all(r.count);
  // What they meet counts as met by diffuse rays: shadow rays have found the lights.
  const Place below{place.level + 1, {place.depth.diffuse, place.depth.specular + 1}, Arrival::diffuse};
  gatherer_.answer(place, below, cached_.growth(place), HitGatherer::any_ray, 1, w);
  r.weigh();
  for (int i = 0; i < r.count; ++i) b.Ci.add(r.point[i], r.L.at(i));
}

}  // namespace dapple::distribution
