// SPDX-License-Identifier: Apache-2.0
// The part of HitShader that gathers what leaves a subsurface body by diffusion.
#include <algorithm>

#include "dapple/distribution/hit_shader.h"

namespace dapple::distribution {

using integrate::offset_origin;
using integrate::PointBatch;
using integrate::RaySet;
using integrate::RayTracer;
using shading::Bsdf;
using shading::BsdfKind;
using trace::no_id;

namespace {

constexpr int max_crossings = 64;  // of one probe with the body
constexpr uint64_t for_probes = 16;

}  // namespace

// Light that diffusion brings to the points of the batch: b.diffuse is the radiosity of the body / pi, before the
// boundary lets it out by direction (Bsdf::crossing).
void HitShader::light_subsurface(const Place& place, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  SubsurfaceBatch& s = w.subsurface_level(place.level);
  s.job_count = 0;
  for (int k = 0; k < b.count; ++k) {
    if (b.bsdf[k].kind != BsdfKind::subsurface) continue;
    for (int i = 0; i < probes(b, k); ++i) {
      s.point[s.job_count] = k;
      s.number[s.job_count] = i;
      if (++s.job_count == s.capacity) send_probes(place, w);
    }
  }
  if (s.job_count > 0) send_probes(place, w);
}

void HitShader::send_probes(const Place& place, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  SubsurfaceBatch& s = w.subsurface_level(place.level);
  for (int j = 0; j < s.job_count; ++j) {
    w.seed[j] = uint32_t(hash(b.key[s.point[j]], for_probes));
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
  trace_probes(n, b, s, w);
  w.stages.tracing_seconds += timer.seconds();
  gather_probes(place, w);
  s.job_count = 0;
}

// Every crossing of the probes with the body that they started from.
void HitShader::trace_probes(int n, const PointBatch& b, SubsurfaceBatch& s, ShadingWorkspace& w) const {
  s.found.clear();
  for (int crossing = 0; n > 0 && crossing < max_crossings; ++crossing) {
    scene_.traced.intersect(s.rays, n, &s.hits);
    w.rays.subsurface += uint64_t(n);
    int kept = 0;
    for (int i = 0; i < n; ++i) {
      if (s.hits.geometry[i] == no_id) continue;
      const int j = s.job[i], k = s.point[j];
      const geom::SurfacePoint p = scene_.traced.surface_without_tangents(s.rays, s.hits, i);
      const bool same = scene_.bindings[s.hits.geometry[i]].material == scene_.bindings[b.geometry[k]].material;
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
void HitShader::gather_probes(const Place& place, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  SubsurfaceBatch& s = w.subsurface_level(place.level);
  const Place below{place.level + 1, {place.depth.diffuse, 0}, Arrival::probe};
  int sets = 0;
  const auto look_up = [&] {
    for (int set = 0; set < sets; ++set) {
      RaySet& r = b.ray_set(set);
      r.L.clear_all(r.count);
      if (!scene_.has_media()) continue;
      if (!r.flights) r.flights = std::make_unique<RayTracer::Flights>();
      r.flights->count = 0;  // those of rays before: probes scatter nowhere
    }
    gather_hits(place, below, 1, any_ray, sets, w);
    for (int set = 0; set < sets; ++set) {
      const RaySet& r = b.ray_set(set);
      for (int i = 0; i < r.count; ++i) b.diffuse.add(r.point[i], r.weight[i], r.L.at(i));
    }
    sets = 0;
  };
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
    const bool behind = dot(b.wo[k], b.surface[k].Ng) < 0;
    const V3f outside = behind ? -at.Ng : at.Ng;
    if (sets == 0 || b.ray_set(sets - 1).count == RaySet::capacity) {
      if (sets == PointBatch::most_ray_sets) look_up();
      b.ray_set(sets++).count = 0;
    }
    RaySet& r = b.ray_set(sets - 1);
    const int i = r.count++;
    const float distance = length(offset);
    // As a ray that comes upon the place from outside, so that look-ups see the side that light enters by.
    const float height = probe.detail(0);
    r.rays.set(i, at.P + outside * height, -outside, 2 * height, at.time, s.key[at.job] + 0x85ebca6bu * (crossing + 1));
    r.hits.t[i] = height, r.hits.u[i] = at.u, r.hits.v[i] = at.v;
    r.hits.nx[i] = at.nx, r.hits.ny[i] = at.ny, r.hits.nz[i] = at.nz;
    r.hits.geometry[i] = at.geometry, r.hits.primitive[i] = at.primitive, r.hits.instance[i] = at.instance;
    r.distance[i] = height;
    r.point[i] = k;
    r.sequence[i] = hash(b.key[k], r.rays.key[i]);
    r.number[i] = 0;
    r.weight[i] = weight;
    r.cone[i] = std::max(probe.detail(distance) - b.width[k] / settings_.cache_width, 0.0f) / height;
    r.spread[i] = 0;
    r.share[i] = 1;
    r.sheets[i] = 0;
    r.medium[i] = surface_media_.by_ray() ? scene_.bindings[at.geometry].medium_at(behind, b.medium[k])
                                          : surface_media_.declared(at.geometry, behind);
  }
  if (sets > 0) look_up();
}

}  // namespace dapple::distribution
