// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/path_answers.h"

#include <algorithm>
#include <utility>

#include "dapple/distribution/cache_numbers.h"

namespace dapple::distribution {

using gi::RadiosityCache;
using integrate::CacheCounts;
using integrate::CacheState;
using integrate::DiffuseHits;
using integrate::PointBatch;
using integrate::RaySet;

struct PathAnswers::Scratch final : Workspace {
  Scratch(int groups, int bounces) : shading(groups) { shading.caches.by_depth.resize(size_t(bounces) + 1); }
  ShadingWorkspace shading;
};

std::unique_ptr<integrate::RadiosityAnswers::Workspace> PathAnswers::make_workspace() const {
  return std::make_unique<Scratch>(groups_, shading_.settings.bounces);
}

void PathAnswers::answer(DiffuseHits& hits, Workspace& workspace) const {
  ShadingWorkspace& w = static_cast<Scratch&>(workspace).shading;
  w.tracing.stop = workspace.stop;
  std::fill_n(hits.known, hits.count, false);
  uint32_t depths = 0;  // a bit each
  for (int n = 0; n < hits.count; ++n) depths |= 1u << std::min(hits.depth[n], 31);
  for (int depth = 1; depth <= shading_.settings.bounces; ++depth)
    if (depths >> depth & 1) answer_depth(depth, hits, w);
}

// As rays of the first set of a batch, each from a point of its own.
void PathAnswers::answer_depth(int depth, DiffuseHits& hits, ShadingWorkspace& w) const {
  constexpr int level = 0;
  PointBatch& b = w.level(level);
  RaySet& r = b.ray_set(0);
  int asked_by[DiffuseHits::capacity];
  // What one point of a pixel sends in all; rays that go on stand for themselves.
  const float rays = float(depth == 1 ? shading_.settings.diffuse_rays.at(0) : 1);
  r.count = 0;
  for (int n = 0; n < hits.count; ++n) {
    if (hits.depth[n] != depth) continue;
    const int i = r.count++, ray = hits.ray[n];
    asked_by[i] = n;
    b.width[i] = hits.width[n];
    r.point[i] = i;
    r.weight[i] = RGB(1);
    r.rays.set(i, hits.rays->origin(ray), hits.rays->direction(ray), infinity, hits.rays->time[ray],
               hits.rays->key[ray]);
    r.hits.copy_lane(i, *hits.hits, ray);
    r.distance[i] = hits.distance[n];
    r.cone[i] = std::min(CacheNumbers::widest_cone, 1 / std::sqrt(hits.pdf[n] * rays));
    r.medium[i] = hits.medium[n];
    r.wavelength[i] = 0;
    r.cached[i] = false;
  }
  r.L.clear_all(r.count);
  const Place place{level, {depth - 1, 0}, depth == 1 ? Arrival::view : Arrival::diffuse};
  const CachedRadiosity& cached = shader_.cached();
  cached.add(place, place.behind_diffuse(), cached.growth(place), HitGatherer::any_ray, 1, w);
  for (int i = 0; i < r.count; ++i) {
    const int n = asked_by[i];
    hits.known[n] = r.cached[i];
    if (!r.cached[i]) continue;
    hits.L.set(n, r.L.at(i));
    hits.onward[n] = chance_of_coat(r, i);
  }
}

float PathAnswers::chance_of_coat(const RaySet& r, int i) const {
  if (!shading_.settings.caustics || !shading_.materials.has_coat(r.hits.geometry[i])) return 0;
  const V3f n = shading_.scene.traced.surface_without_tangents(r.rays, r.hits, i).Ns;
  return std::max(scattering::CommonCoat::reflectance(dot(n, r.rays.direction(i))), CacheNumbers::least_coats);
}

void PathAnswers::collect_counts(Workspace& workspace, integrate::RayCounts* rays, integrate::StageCounts* stages,
                                 std::span<CacheCounts> caches) const {
  ShadingWorkspace& w = static_cast<Scratch&>(workspace).shading;
  *rays += std::exchange(w.rays, {});
  *stages += std::exchange(w.stages, {});
  collect(w.caches, 1, shading_.settings.bounces, caches.data());
}

std::vector<CacheState> PathAnswers::states(const RadiosityCache& cache, int first_depth, int last_depth) {
  std::vector<CacheState> states;
  for (int r = 0; r < integrate::resolution_count; ++r) {
    states.push_back(cache.state(integrate::Resolution(r)));
    states.back().name = "radiosity." + std::string(integrate::resolution_names[size_t(r)]);
  }
  for (int d = first_depth; d <= last_depth; ++d)
    states.push_back({.name = "radiosity.depth" + std::to_string(d), .has_memory = false});
  return states;
}

void PathAnswers::collect(RadiosityCache::Counts& counts, int first_depth, int last_depth, CacheCounts* to) {
  for (CacheCounts& c : counts.by_resolution) *to++ += std::exchange(c, {});
  for (int d = first_depth; d <= last_depth; ++d) *to++ += std::exchange(counts.by_depth[size_t(d)], {});
}

}  // namespace dapple::distribution
