// SPDX-License-Identifier: Apache-2.0
// The part of HitShader that follows light through media.
#include "dapple/distribution/hit_shader.h"

namespace dapple::distribution {

using integrate::PointBatch;
using integrate::RaySet;
using integrate::RayTracer;

namespace {
constexpr uint32_t for_flights = 0x666c79, for_phase = 0x706873;  // of random numbers
}  // namespace

void HitShader::set_flight(const RayTracer::Flights& flights, int f, const trace::RayBatch& rays, int share,
                           PointBatch& b, int k) {
  const int r = flights.ray[f];
  b.parent[k] = r;
  b.surface[k] = {};
  b.surface[k].P = flights.P[f];
  b.geometry[k] = trace::no_id;
  b.wo[k] = -rays.direction(r);
  b.set_one_time(k, rays.time[r]);
  b.width[k] = rays.width[r] + rays.spread[r] * length(flights.P[f] - rays.origin(r));
  b.spread[k] = rays.spread[r];
  b.medium[k] = flights.medium[f];
  b.set_key(k, hash(rays.key[r], for_flights));
  b.share[k] = share;
  b.crowd[k] = b.effort[k] = 1;
}

void HitShader::shade_media(const Place& place, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  RaySet& r = b.ray_set(0);
  b.Ci.clear_all(b.count);
  direct_.light_media(b, list_depth(place), w);
  if (place.depth.specular >= settings_.specular_depth) return;
  for (int k = 0; k < b.count; ++k) w.seed[k] = uint32_t(hash(b.key[k], for_phase)), w.index[k] = 0;
  w.draw_samples(b.count);
  for (int k = 0; k < b.count; ++k) {
    V3f d;
    const float pdf = scene_.media[size_t(b.medium[k])]->phase().sample(b.wo[k], V2f(w.u0[k], w.u1[k]), &d);
    r.point[k] = k;
    r.sequence[k] = b.key[k];
    r.number[k] = 0;
    r.weight[k] = RGB(1);
    r.cone[k] = std::max(b.spread[k], std::min(widest_cone, 1 / std::sqrt(pdf * float(b.share[k]))));
    r.spread[k] = std::max(b.spread[k], std::min(widest_spread, r.cone[k]));
    r.share[k] = b.share[k];
    r.medium[k] = b.medium[k];
    r.rays.set(k, b.surface[k].P, d, infinity, b.time[k], w.seed[k], b.width[k], r.spread[k]);
  }
  r.count = b.count;
  w.rays.specular += uint64_t(r.count);
  trace_rays(r, w);
  r.L.clear_all(r.count);
  // What they meet counts as met by diffuse rays: shadow rays have found the lights.
  const Place below{place.level + 1, {place.depth.diffuse, place.depth.specular + 1}, Arrival::diffuse};
  gather_hits(place, below, growth(place), any_ray, 1, w);
  r.weigh();
  for (int i = 0; i < r.count; ++i) b.Ci.add(r.point[i], r.L.at(i));
}

void HitShader::add_media(RaySet& r, const Place& below, RayFilter wanted, ShadingWorkspace& w) const {
  PointBatch& in_media = w.level(below.level);
  in_media.count = 0;
  for (int f = 0; f < r.flights->count; ++f) {
    const int ray = r.flights->ray[f];
    if (wanted(r, ray)) set_flight(*r.flights, f, r.rays, r.share[ray], in_media, in_media.count++);
  }
  if (in_media.count == 0) return;
  shade_media(below, w);
  for (int k = 0; k < in_media.count; ++k) r.L.add(in_media.parent[k], in_media.Ci.at(k));
}

}  // namespace dapple::distribution
