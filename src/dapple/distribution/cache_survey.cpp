// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/cache_survey.h"

namespace dapple::distribution {

using gi::CacheAnswers;
using gi::CacheBatch;
using gi::RadiosityCache;
using gi::TileLinks;
using integrate::PointBatch;
using integrate::RaySet;

void CacheSurvey::ask(const Place& place, CacheAnswers* answers, ShadingWorkspace& w) const {
  const PointBatch& b = w.level(place.level);
  w.job_count = 0;
  for (int k = 0; k < b.count; ++k) {
    answers[k] = {};
    if (!b.bsdf[k].is_diffuse() || b.bsdf[k].albedo().is_black()) continue;
    const int rays = shading_.settings.diffuse_ray_count(place, b, k);
    DiffuseRays::add_jobs(place, b, k, std::min(rays, CacheAnswers::max_rays), rays, w,
                          [&] { ask_rays(place, answers, w); });
  }
  if (w.job_count > 0) ask_rays(place, answers, w);
}

// Goes the way of gather() up to the cache, and does not ask it.
void CacheSurvey::ask_rays(const Place& place, CacheAnswers* answers, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  CacheBatch& c = w.cache_level(place.level);
  RaySet& r = b.ray_set(0);
  shader_.diffuse_rays().draw(place, r, w);
  shading_.trace(r, w);
  const Place below = place.behind_diffuse();
  shader_.cached().locate(place, below, shader_.cached().growth(place), HitGatherer::any_ray, 1, w);
  std::fill_n(r.cached, r.count, false);
  TileLinks links[RaySet::capacity];
  for (int e = 0; e < c.entry_count; ++e) w.linking.jobs[e] = {c.entry[e].grid, &links[e]};
  w.linking.job_count = c.entry_count;
  shading_.link(w);
  for (int n = 0; n < c.count; ++n) {
    if (!links[c.entry_of[n]].serves(c.point[n], c.nearest[n])) continue;
    r.cached[c.ray[n]] = true;
    answers[r.point[c.ray[n]]].add(RadiosityCache::resolution(c.point[n].grid), log_.find(c.entry[c.entry_of[n]].key));
  }
  for (int i = 0; i < r.count; ++i) {
    CacheAnswers& of_point = answers[r.point[i]];
    ++of_point.rays;
    if (r.hits.geometry[i] != trace::no_id && !r.cached[i]) ++of_point.shaded;
  }
}

}  // namespace dapple::distribution
