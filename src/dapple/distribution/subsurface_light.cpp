// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/subsurface_light.h"

#include <algorithm>
#include <utility>

namespace dapple::distribution {

using integrate::offset_origin;
using integrate::PointBatch;
using integrate::RaySet;
using integrate::RayTracer;
using scattering::BsdfKind;
using trace::no_id;

namespace {
constexpr int max_crossings = 64;  // of one probe with the body
}  // namespace

// Light that diffusion brings to the points of the batch: b.diffuse is the radiosity of the body / pi, before the
// boundary lets it out by direction (Bsdf::crossing).
void SubsurfaceLight::light(const Place& place, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  SubsurfaceBatch& s = w.subsurface_level(place.level);
  s.job_count = 0;
  for (int k = 0; k < b.count; ++k) {
    if (b.bsdf[k].kind != BsdfKind::subsurface) continue;
    for (int i = 0; i < probes(b, k); ++i) {
      s.point[s.job_count] = k;
      s.number[s.job_count] = i;
      if (++s.job_count == s.capacity) send(place, w);
    }
  }
  if (s.job_count > 0) send(place, w);
}

void SubsurfaceLight::send(const Place& place, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  SubsurfaceBatch& s = w.subsurface_level(place.level);
  for (int j = 0; j < s.job_count; ++j) {
    w.seed[j] = uint32_t(random_of(b.key[s.point[j]], Purpose::probes));
    w.index[j] = uint32_t(s.number[j]);
  }
  w.draw_samples(s.job_count);
  SubsurfaceProbe probe;
  int n = 0;
  for (int j = 0; j < s.job_count; ++j) {
    const int k = s.point[j];
    if (j == 0 || k != s.point[j - 1]) probe = SubsurfaceProbe(b.bsdf[k], probes(b, k));
    if (probe.is_black()) continue;
    const auto chord = probe.chord(s.number[j], V2f(w.u0[j], w.u1[j]), w.u2[j]);
    s.key[j] = trace::ray_key(w.seed[j], w.index[j]);
    s.rays.set(n, b.surface[k].P + chord.offset, chord.d, chord.length, b.ray_time(k, s.number[j], w.seed[j]),
               s.key[j]);
    s.job[n++] = j;
  }
  const Timer timer;
  trace(n, b, s, w);
  w.stages.tracing_seconds += timer.seconds();
  gather(place, w);
  s.job_count = 0;
}

// Every crossing of the probes with the body that they started from.
void SubsurfaceLight::trace(int n, const PointBatch& b, SubsurfaceBatch& s, ShadingWorkspace& w) const {
  s.found.clear();
  for (int crossing = 0; n > 0 && crossing < max_crossings; ++crossing) {
    shading_.scene.traced.intersect(s.rays, n, &s.hits);
    w.rays.subsurface += uint64_t(n);
    int kept = 0;
    for (int i = 0; i < n; ++i) {
      if (s.hits.geometry[i] == no_id) continue;
      const int j = s.job[i], k = s.point[j];
      const geom::SurfacePoint p = shading_.scene.traced.surface_without_tangents(s.rays, s.hits, i);
      const bool same =
          shading_.scene.bindings[s.hits.geometry[i]].material == shading_.scene.bindings[b.geometry[k]].material;
      const trace::HitBatch& h = s.hits;
      if (same)
        s.found.push_back({j, h.u[i], h.v[i], h.nx[i], h.ny[i], h.nz[i], s.rays.time[i], h.geometry[i], h.primitive[i],
                           h.instance[i], p.P, p.Ng});
      const V3f d = s.rays.direction(i);
      const float left = s.rays.t_max[i] - s.hits.t[i];
      if (!(left > 0)) continue;
      s.rays.set(kept, offset_origin(p, d), d, left, s.rays.time[i], s.rays.key[i]);
      s.job[kept++] = j;
    }
    n = kept;
  }
  // By probe, whatever the batch: sums must not depend on who shared it.
  std::stable_sort(s.found.begin(), s.found.end(), [](const auto& x, const auto& y) { return x.job < y.job; });
}

// Looks the light up that enters where probes met the body, or computes it there, a full batch at a time.
void SubsurfaceLight::gather(const Place& place, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  SubsurfaceBatch& s = w.subsurface_level(place.level);
  int sets = 0;
  SubsurfaceProbe probe;
  uint32_t crossing = 0;
  for (size_t f = 0; f < s.found.size(); ++f) {
    const SubsurfaceBatch::Found& at = s.found[f];
    crossing = f > 0 && s.found[f - 1].job == at.job ? crossing + 1 : 0;
    const int k = s.point[at.job];
    const V3f offset = at.P - b.surface[k].P;
    if (f == 0 || k != s.point[s.found[f - 1].job]) probe = SubsurfaceProbe(b.bsdf[k], probes(b, k));
    const RGB weight = probe.weight(offset, at.Ng);
    if (weight.is_black() || !weight.is_finite()) continue;
    if (sets == 0 || b.ray_set(sets - 1).count == RaySet::capacity) {
      if (sets == PointBatch::most_ray_sets) look_up(place, std::exchange(sets, 0), w);
      b.ray_set(sets++).count = 0;
    }
    RaySet& r = b.ray_set(sets - 1);
    set_ray(probe, at, s.key[at.job] + 0x85ebca6bu * (crossing + 1), weight, b, k, r, r.count++);
  }
  if (sets > 0) look_up(place, std::exchange(sets, 0), w);
}

// Adds the light that enters where these rays end.
void SubsurfaceLight::look_up(const Place& place, int sets, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  for (int set = 0; set < sets; ++set) {
    RaySet& r = b.ray_set(set);
    r.L.clear_all(r.count);
    if (!shading_.scene.has_media()) continue;
    if (!r.flights) r.flights = std::make_unique<RayTracer::Flights>();
    r.flights->count = 0;  // those of rays before: probes scatter nowhere
  }
  gatherer_.answer(place, {place.level + 1, {place.depth.diffuse, 0}, Arrival::probe}, 1, HitGatherer::any_ray, sets,
                   w);
  for (int set = 0; set < sets; ++set) {
    const RaySet& r = b.ray_set(set);
    for (int i = 0; i < r.count; ++i) b.diffuse.add(r.point[i], r.weight[i], r.L.at(i));
  }
}

// Writes ray i of a set as one that comes upon the place from outside, so that look-ups see the side that light enters
// by.
void SubsurfaceLight::set_ray(const SubsurfaceProbe& probe, const SubsurfaceBatch::Found& at, uint32_t key,
                              const RGB& weight, const PointBatch& b, int k, RaySet& r, int i) const {
  const bool behind = dot(b.wo[k], b.surface[k].Ng) < 0;
  const V3f outside = behind ? -at.Ng : at.Ng;
  const float distance = length(at.P - b.surface[k].P), height = probe.detail(0);
  r.rays.set(i, at.P + outside * height, -outside, 2 * height, at.time, key);
  r.hits.t[i] = height, r.hits.u[i] = at.u, r.hits.v[i] = at.v;
  r.hits.nx[i] = at.nx, r.hits.ny[i] = at.ny, r.hits.nz[i] = at.nz;
  r.hits.geometry[i] = at.geometry, r.hits.primitive[i] = at.primitive, r.hits.instance[i] = at.instance;
  r.distance[i] = height;
  r.point[i] = k;
  r.sequence[i] = hash(b.key[k], r.rays.key[i]);
  r.number[i] = 0;
  r.weight[i] = weight;
  r.cone[i] = std::max(probe.detail(distance) - b.width[k] / shading_.settings.cache_width, 0.0f) / height;
  r.spread[i] = 0;
  r.share[i] = 1;
  r.throughput[i] = 1;
  r.sheets[i] = 0;
  r.wavelength[i] = 0;
  r.medium[i] = shading_.surface_media.by_ray() ? shading_.scene.bindings[at.geometry].medium_at(behind, b.medium[k])
                                                : shading_.surface_media.declared(at.geometry, behind);
}

}  // namespace dapple::distribution
