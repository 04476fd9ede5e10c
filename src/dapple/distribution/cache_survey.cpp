// SPDX-License-Identifier: Apache-2.0
// The part of HitShader that says what answers diffuse rays, for pictures of the radiosity cache.
#include "dapple/distribution/hit_shader.h"

namespace dapple::distribution {

using gi::CacheAnswers;
using gi::CacheBatch;
using gi::CacheLog;
using gi::RadiosityCache;
using gi::TileLinks;
using integrate::PointBatch;
using integrate::RaySet;

void HitShader::survey(const Place& place, const CacheLog& log, CacheAnswers* answers, ShadingWorkspace& w) const {
  const PointBatch& b = w.level(place.level);
  w.job_count = 0;
  for (int k = 0; k < b.count; ++k) {
    answers[k] = {};
    if (!b.bsdf[k].is_diffuse() || b.bsdf[k].albedo().is_black()) continue;
    const int rays = diffuse_rays(place, b, k);
    add_diffuse_jobs(b, k, std::min(rays, CacheAnswers::max_rays), rays, w,
                     [&] { survey_rays(place, log, answers, w); });
  }
  if (w.job_count > 0) survey_rays(place, log, answers, w);
}

// Goes the way of gather() up to the cache, and does not ask it.
void HitShader::survey_rays(const Place& place, const CacheLog& log, CacheAnswers* answers, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  CacheBatch& c = w.cache_level(place.level);
  RaySet& r = b.ray_set(0);
  draw_diffuse_rays(place, r, w);
  trace_rays(r, w);
  const Place below = behind_diffuse(place);
  locate_radiosity(place, below, growth(place), any_ray, 1, w);
  std::fill_n(r.cached, r.count, false);
  TileLinks links[RaySet::capacity];
  for (int e = 0; e < c.entry_count; ++e) w.linking.jobs[e] = {c.entry[e].grid, &links[e]};
  w.linking.job_count = c.entry_count;
  link(w);
  for (int n = 0; n < c.count; ++n) {
    if (!links[c.entry_of[n]].serves(c.point[n], c.nearest[n])) continue;
    r.cached[c.ray[n]] = true;
    answers[r.point[c.ray[n]]].add(RadiosityCache::resolution(c.point[n].grid), log.find(c.entry[c.entry_of[n]].key));
  }
  for (int i = 0; i < r.count; ++i) {
    CacheAnswers& of_point = answers[r.point[i]];
    ++of_point.rays;
    if (r.hits.geometry[i] != trace::no_id && !r.cached[i]) ++of_point.shaded;
  }
}

}  // namespace dapple::distribution
