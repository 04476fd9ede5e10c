// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/ray_tracer.h"

#include <algorithm>

#include "dapple/integrate/ray_origin.h"
#include "dapple/scattering/sheet.h"

namespace dapple::integrate {

namespace {
constexpr int max_segments = 4096;  // ends a ray caught between surfaces that are not there

bool draw_sheet(uint32_t ray_key, int segment, float through) {
  return through == 1 || (through > 0 && to_unit_float(hash(RayTracer::sheet_key(ray_key, segment), 1)) < through);
}

// No surface lets shadow rays through, so that each lies in the medium in which it sets out.
bool all_stop(const scene::Scene& scene, const MaterialTable& materials) {
  if (materials.any_sheet()) return false;
  for (uint32_t g = 0; g < scene.bindings.size(); ++g)
    if (materials.passes(g)) return false;
  return true;
}

// What is visible, by what the medium lets through.
void weaken(const scene::Scene& scene, const trace::RayBatch& rays, int n, const int32_t* medium, RayTracer::Scratch& s,
            RGB* visible) {
  const auto in = [&](int i) { return visible[i].is_black() ? scene::vacuum : medium[i]; };
  const auto add = [&](int i, media::MediumRays* out) {
    out->add(Ray{rays.origin(i), rays.direction(i), infinity, rays.time[i]}, rays.t_max[i], RGB(1),
             hash(rays.key[i], 0));
  };
  s.media.transmittance(scene, n, in, add, s.transmittance);
  for (int i = 0; i < n; ++i) visible[i] *= s.transmittance[i];
}

}  // namespace

RayTracer::RayTracer(const scene::Scene& scene, const MaterialTable& materials, bool media,
                     const emitters::Visibility* masks)
    : scene_(scene),
      materials_(materials),
      media_(media),
      all_stop_(!materials.shadows_pass() || all_stop(scene, materials)),
      masks_(masks) {
  if (!masks || !media || !scene.has_media()) return;
  if (MediumBorders::obstacle(scene, materials).empty())
    borders_ = MediumBorders::find(scene, materials);
  else
    masks_ = nullptr;
}

// s.found of rays that masks have answered: what the media leave of it, from where the rays set out to infinity.
void RayTracer::dim_masked(const trace::RayBatch& rays, int n, const int32_t* medium, Scratch& s) const {
  for (int k = 0; k < n; ++k) {
    const int i = s.masked_ray[k];
    s.rays.set(k, rays.origin(i), rays.direction(i), infinity, rays.time[i], rays.key[i]);
    s.medium[k] = medium[i], s.ray[k] = k;
  }
  for (int segment = 0; n > 0 && segment < max_segments; ++segment) {
    if (borders_)
      borders_->traced().intersect(s.rays, n, &s.hits);
    else
      std::fill_n(s.hits.geometry, n, trace::no_id);
    const auto in = [&](int j) { return s.found[s.ray[j]].is_black() ? scene::vacuum : s.medium[j]; };
    const auto add = [&](int j, media::MediumRays* out) {
      out->add(s.segment(j), s.length(j), RGB(1), hash(rays.key[s.masked_ray[s.ray[j]]], segment));
    };
    s.media.transmittance(scene_, n, in, add, s.transmittance);
    int kept = 0;
    for (int j = 0; j < n; ++j) {
      RGB& found = s.found[s.ray[j]];
      found *= s.transmittance[j];
      if (s.hits.geometry[j] == trace::no_id || found.is_black()) continue;
      const V3f d = s.rays.direction(j);
      const geom::SurfacePoint p = borders_->traced().surface_without_tangents(s.rays, s.hits, j);
      const scene::GeometryBinding& border = scene_.bindings[borders_->geometry(s.hits.geometry[j])];
      s.medium[kept] = border.medium_beyond(d, p.Ng, s.medium[j]);
      s.ray[kept] = s.ray[j];
      s.rays.set(kept++, offset_origin(p, d), d, infinity, s.rays.time[j], s.rays.key[j]);
    }
    n = kept;
  }
}

// s.transmittance of the segments up to the hits; `rays` are the whole rays, whose keys count. What is behind opaque
// surfaces is left out.
void RayTracer::transmit(const trace::RayBatch& rays, int n, int segment, Scratch& s) const {
  const auto medium = [&](int i) {
    const bool stopped =
        s.hits.geometry[i] != trace::no_id && s.opaque_stops && !materials_.lets_through(s.hits.geometry[i]);
    return media_ && !stopped ? s.medium[i] : scene::vacuum;
  };
  const auto add = [&](int i, media::MediumRays* out) {
    out->add(s.segment(i), s.length(i), RGB(1), hash(rays.key[s.ray[i]], segment));
  };
  s.media.transmittance(scene_, n, medium, add, s.transmittance);
}

// s.through of the hits of a segment.
void RayTracer::meet_sheets(const trace::RayBatch& rays, int n, int segment, Scratch& s) const {
  if (!s.sheets) s.sheets = std::make_unique<Scratch::Sheets>();
  Scratch::Sheets& met = *s.sheets;
  met.count = 0;
  for (int i = 0; i < n; ++i) {
    const uint32_t geometry = s.hits.geometry[i];
    const bool hit = geometry != trace::no_id;
    s.through[i] = !hit || materials_.passes(geometry) ? 1.0f : 0.0f;
    if (!hit || !materials_.is_sheet(geometry)) continue;
    const int k = met.count++;
    met.lane[k] = i;
    met.geometry[k] = geometry;
    met.surface[k] = materials_.needs_tangents(geometry) ? scene_.traced.surface(s.hits, i, s.rays.time[i])
                                                         : scene_.traced.surface_without_tangents(s.rays, s.hits, i);
  }
  if (met.count == 0) return;
  const auto describe = [&](int k, pattern::ShadingPoints* points, int lane) {
    const int i = met.lane[k];
    const float width = s.rays.width[i] + s.rays.spread[i] * s.hits.t[i];
    scene::Scene::set_point(met.surface[k], s.rays.direction(i), width, s.rays.time[i],
                            sheet_key(rays.key[s.ray[i]], segment), points, lane);
  };
  materials_.prelight(met.count, met.geometry, met.surface, describe, met.bsdf, met.prelighting, &s.stages);
  for (int k = 0; k < met.count; ++k)
    s.through[met.lane[k]] = scattering::straight_transmittance(met.bsdf[k], -s.rays.direction(met.lane[k]));
}

// s.flight of the same segments.
void RayTracer::fly(const trace::RayBatch& rays, int n, int segment, const RGB* passed, int32_t certain,
                    Scratch& s) const {
  const auto add = [&](int i, media::MediumRays* out) {
    out->add(s.segment(i), s.length(i), passed[s.ray[i]], hash(rays.key[s.ray[i]], segment, 2));
  };
  s.media.sample(
      scene_, n, [&](int i) { return s.medium[i] == certain ? scene::vacuum : s.medium[i]; }, add, s.flight);
}

// Along the segment of ray i.
void RayTracer::add_emitted(const Scratch& s, int i, const RGB& emitted, Flights* flights) const {
  if (emitted.is_black()) return;
  const uint32_t light = scene_.glow_light(s.medium[i], s.rays.origin(i));
  if (light == trace::no_id)
    flights->emitted[s.ray[i]] += emitted;
  else
    flights->lit.push_back({s.ray[i], light, emitted});
}

// Takes ray i to its hit. False if it does not arrive.
bool RayTracer::arrive(const Scratch& s, int i, RGB* passed, float* distance, Flights* flights) const {
  if (s.medium[i] == scene::vacuum) return true;
  const media::MediumSample& flight = s.flight[i];
  add_emitted(s, i, *passed * flight.emitted, flights);
  *passed *= flight.weight;
  if (!flight.scattered && !passed->is_black()) return true;
  *distance += flight.scattered ? flight.t : 0;
  if (passed->is_black()) return false;
  const int f = flights->count++;
  flights->weight[f] = *passed;
  flights->ray[f] = s.ray[i];
  flights->P[f] = s.rays.origin(i) + s.rays.direction(i) * flight.t;
  flights->medium[f] = s.medium[i];
  return false;
}

// Takes ray i through the medium in which nothing is left to chance.
void RayTracer::pass_for_certain(Scratch& s, int i, uint64_t key, RGB* passed, float distance, Flights* flights) const {
  const media::Medium& air = *scene_.media[size_t(s.medium[i])];
  const int r = s.ray[i];
  const Ray ray = s.segment(i);
  const float length = s.length(i);
  const media::MediumCrossing crossing = air.cross(ray, length, *passed, key, flights->scatters);
  flights->ways.push_back({r, ray.d, distance, distance + length, *passed, crossing.transmittance});
  add_emitted(s, i, *passed * crossing.emitted, flights);
  if (flights->scatters) {
    const media::MediumSample& drawn = crossing.scattering;
    const RGB weight = *passed * drawn.weight;
    const float size = weight.max();
    if (drawn.scattered && size > 0 && weight.is_finite()) {
      s.drawn_from[r] += size;
      if (to_unit_float(hash(key, 1)) * s.drawn_from[r] < size) {
        s.drawn_at[r] = ray.o + ray.d * drawn.t;
        s.drawn_weight[r] = weight * (1 / size);
      }
    }
  }
  *passed *= crossing.transmittance;
}

// Sets lane `to` <= i to what follows the surface that ray i hit.
void RayTracer::go_on(int i, int to, uint64_t key, Scratch& s) const {
  const V3f d = s.rays.direction(i);
  const geom::SurfacePoint p = scene_.traced.surface_without_tangents(s.rays, s.hits, i);
  const int32_t medium = scene_.bindings[s.hits.geometry[i]].medium_beyond(d, p.Ng, s.medium[i]);
  s.rays.set(to, offset_origin(p, d), d, s.rays.t_max[i] - s.hits.t[i], s.rays.time[i], uint32_t(key),
             s.rays.width[i] + s.rays.spread[i] * s.hits.t[i], s.rays.spread[i]);
  s.medium[to] = medium;
  s.ray[to] = s.ray[i];
}

void RayTracer::visible(const trace::RayBatch& rays, int n, const int32_t* medium, RGB* visible, Scratch& s) const {
  s.stop.check();
  if (!all_stop_) return visible_through(rays, n, medium, visible, s);
  scene_.traced.transmitted(rays, n, visible);
  if (materials_.shadows_pass() && media_) weaken(scene_, rays, n, medium, s, visible);
}

int RayTracer::visible(const trace::RayBatch& rays, const V3f* Ng, int n, const int32_t* medium, RGB* visible,
                       Scratch& s) const {
  s.stop.check();
  if (!masks_) {
    this->visible(rays, n, medium, visible, s);
    return 0;
  }
  static_assert(emitters::ShadowRays::capacity == capacity);
  int masked = 0, unmasked = 0;
  for (int i = 0; i < n; ++i) {
    const V3f d = rays.direction(i);
    if (std::isinf(rays.t_max[i]) && masks_->answers(rays.origin(i), Ng[i], d)) {
      s.masked.P[masked] = rays.origin(i), s.masked.Ng[masked] = Ng[i], s.masked.d[masked] = d,
      s.masked.key[masked] = rays.key[i];
      s.masked_ray[masked++] = i;
      continue;
    }
    s.unmasked.set(unmasked, rays.origin(i), d, rays.t_max[i], rays.time[i], rays.key[i], rays.width[i],
                   rays.spread[i]);
    s.unmasked_medium[unmasked] = medium[i];
    s.unmasked_ray[unmasked++] = i;
  }
  s.masked.count = masked;
  masks_->visible(s.masked, s.found);
  if (media_ && masked > 0 && scene_.has_media()) dim_masked(rays, masked, medium, s);
  for (int k = 0; k < masked; ++k) visible[s.masked_ray[k]] = s.found[k];
  if (unmasked > 0) this->visible(s.unmasked, unmasked, s.unmasked_medium, s.found, s);
  for (int k = 0; k < unmasked; ++k) visible[s.unmasked_ray[k]] = s.found[k];
  return masked;
}

void RayTracer::Scratch::Glow::Part::add(const trace::RayBatch& from, int i, const V3f& normal, int32_t in) {
  rays.set(count, from.origin(i), from.direction(i), from.t_max[i], from.time[i], from.key[i], from.width[i],
           from.spread[i]);
  Ng[count] = normal;
  medium[count] = in;
  ray[count++] = i;
}

int RayTracer::visible(const trace::RayBatch& rays, const V3f* Ng, int n, const int32_t* medium,
                       const uint32_t* glow_light, RGB* visible, Scratch& s) const {
  const auto glows = [](uint32_t light) { return light != trace::no_id; };
  if (std::none_of(glow_light, glow_light + n, glows)) return this->visible(rays, Ng, n, medium, visible, s);
  if (!s.glow) s.glow = std::make_unique<Scratch::Glow>();
  auto &glowing = s.glow->glowing, &others = s.glow->others;
  glowing.count = others.count = 0;
  for (int i = 0; i < n; ++i) {
    if (glows(glow_light[i])) s.glow->light[glowing.count] = glow_light[i];
    (glows(glow_light[i]) ? glowing : others).add(rays, i, Ng[i], medium[i]);
  }
  const int masked =
      others.count > 0 ? this->visible(others.rays, others.Ng, others.count, others.medium, others.found, s) : 0;
  glow(glowing.rays, glowing.count, glowing.medium, s.glow->light, glowing.found, s);
  for (const auto* part : {&glowing, &others})
    for (int k = 0; k < part->count; ++k) visible[part->ray[k]] = part->found[k];
  return masked;
}

// From surface to surface, until one stops it, it scatters, or the light lies behind. A segment is never cut short: all
// that glows along it belongs to the light, as it does for rays that find it by chance.
void RayTracer::glow(const trace::RayBatch& rays, int n, const int32_t* medium, const uint32_t* light, RGB* emitted,
                     Scratch& s) const {
  s.stop.check();
  RGB* const passed = s.glow->passed;
  float* const left = s.glow->left;
  for (int i = 0; i < n; ++i) {
    s.rays.set(i, rays.origin(i), rays.direction(i), infinity, rays.time[i], rays.key[i], rays.width[i],
               rays.spread[i]);
    left[i] = rays.t_max[i];
    s.medium[i] = medium[i];
    s.ray[i] = i;
    passed[i] = RGB(1);
    emitted[i] = RGB();
  }
  const bool colored = scene_.traced.has_colored_opacity();
  for (int segment = 0; n > 0 && segment < max_segments; ++segment) {
    scene_.traced.intersect(s.rays, n, &s.hits);
    fly(rays, n, segment, passed, Flights::all_gamble, s);
    if (materials_.any_sheet()) meet_sheets(rays, n, segment, s);
    int kept = 0;
    for (int i = 0; i < n; ++i) {
      const int r = s.ray[i];
      if (s.medium[i] != scene::vacuum) {
        const media::MediumSample& flight = s.flight[i];
        if (!flight.emitted.is_black() && scene_.glow_light(s.medium[i], s.rays.origin(i)) == light[r])
          emitted[r] += passed[r] * flight.emitted;
        if (flight.scattered) continue;
        passed[r] *= flight.weight;
      }
      if (s.hits.geometry[i] == trace::no_id || !materials_.lets_through(s.hits.geometry[i])) continue;
      if (materials_.any_sheet()) passed[r] *= s.through[i];
      if (colored) passed[r] *= s.hits.weight(i);
      left[r] -= s.hits.t[i];
      if (left[r] > 0 && !passed[r].is_black()) go_on(i, kept++, hash(rays.key[r], segment, 1), s);
    }
    n = kept;
  }
}

// From surface to surface.
void RayTracer::visible_through(const trace::RayBatch& rays, int n, const int32_t* medium, RGB* visible,
                                Scratch& s) const {
  s.opaque_stops = true;
  for (int i = 0; i < n; ++i) {
    s.rays.set(i, rays.origin(i), rays.direction(i), rays.t_max[i], rays.time[i], rays.key[i], rays.width[i],
               rays.spread[i]);
    s.medium[i] = medium[i];
    s.ray[i] = i;
    visible[i] = RGB(1);
  }
  const bool colored = scene_.traced.has_colored_opacity();
  for (int segment = 0; n > 0 && segment < max_segments; ++segment) {
    scene_.traced.intersect(s.rays, n, &s.hits);
    transmit(rays, n, segment, s);
    if (materials_.any_sheet()) meet_sheets(rays, n, segment, s);
    int kept = 0;
    for (int i = 0; i < n; ++i) {
      const int r = s.ray[i];
      const bool hit = s.hits.geometry[i] != trace::no_id;
      if (hit && !materials_.lets_through(s.hits.geometry[i])) {
        visible[r] = RGB();
        continue;
      }
      visible[r] *= s.transmittance[i];
      if (materials_.any_sheet()) visible[r] *= s.through[i];
      if (colored) visible[r] *= s.hits.weight(i);
      if (hit && !visible[r].is_black()) go_on(i, kept++, hash(rays.key[r], segment, 1), s);
    }
    n = kept;
  }
}

void RayTracer::nearest(trace::RayBatch& rays, int n, int32_t* medium, trace::HitBatch* hits, float* distance,
                        RGB* passed, Scratch& s, Flights* flights, int* sheets) const {
  s.stop.check();
  const bool through_sheets = sheets && materials_.any_sheet();
  if (sheets) std::fill_n(sheets, n, 0);
  const int all = n;
  if (flights) {
    flights->count = 0;
    flights->ways.clear();
    std::fill_n(flights->emitted, n, RGB());
    flights->lit.clear();
    if (flights->certain != Flights::all_gamble) std::fill_n(s.drawn_from, n, 0.0f);
  }
  scene_.traced.intersect(rays, n, hits);
  const bool colored = scene_.traced.has_colored_opacity();
  for (int i = 0; i < n; ++i) {
    distance[i] = hits->geometry[i] == trace::no_id ? infinity : hits->t[i];
    passed[i] = colored ? hits->weight(i) : RGB(1);
  }
  if (!materials_.rays_pass() && !through_sheets) return;
  s.hits = *hits;
  s.opaque_stops = false;
  for (int i = 0; i < n; ++i) {
    s.rays.set(i, rays.origin(i), rays.direction(i), rays.t_max[i], rays.time[i], rays.key[i], rays.width[i],
               rays.spread[i]);
    s.medium[i] = medium[i];
    s.ray[i] = i;
    distance[i] = 0;
  }
  for (int segment = 0; n > 0 && segment < max_segments; ++segment) {
    if (segment > 0) scene_.traced.intersect(s.rays, n, &s.hits);
    flights ? fly(rays, n, segment, passed, flights->certain, s) : transmit(rays, n, segment, s);
    if (through_sheets) meet_sheets(rays, n, segment, s);
    int kept = 0;
    for (int i = 0; i < n; ++i) {
      const int r = s.ray[i];
      const bool hit = s.hits.geometry[i] != trace::no_id;
      if (colored && segment > 0) passed[r] *= s.hits.weight(i);
      if (!flights) {
        passed[r] *= s.transmittance[i];
      } else if (s.medium[i] == flights->certain) {
        pass_for_certain(s, i, hash(rays.key[r], segment, 4), &passed[r], distance[r], flights);
      } else if (!arrive(s, i, &passed[r], &distance[r], flights)) {
        hits->geometry[r] = trace::no_id;
        continue;
      }
      distance[r] += hit ? s.hits.t[i] : infinity;
      rays.ox[r] = s.rays.ox[i], rays.oy[r] = s.rays.oy[i], rays.oz[r] = s.rays.oz[i];
      medium[r] = s.medium[i];
      hits->copy_lane(r, s.hits, i);
      if (!hit ||
          !(through_sheets ? draw_sheet(rays.key[r], segment, s.through[i]) : materials_.passes(s.hits.geometry[i])))
        continue;
      if (sheets) ++sheets[r];
      go_on(i, kept++, hash(rays.key[r], segment, 1), s);
    }
    n = kept;
  }
  for (int i = 0; i < n; ++i) hits->geometry[s.ray[i]] = trace::no_id;
  if (flights && flights->certain != Flights::all_gamble) add_drawn_flights(all, s, flights);
}

// Where rays do not gamble in one medium, no other scatters: one flight a ray at most.
void RayTracer::add_drawn_flights(int n, Scratch& s, Flights* flights) const {
  for (int r = 0; r < n; ++r) {
    if (!(s.drawn_from[r] > 0)) continue;
    const int f = flights->count++;
    flights->ray[f] = r;
    flights->P[f] = s.drawn_at[r];
    flights->medium[f] = flights->certain;
    flights->weight[f] = s.drawn_weight[r] * s.drawn_from[r];
  }
}

}  // namespace dapple::integrate
