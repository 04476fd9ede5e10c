// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/hit_gatherer.h"

#include "dapple/distribution/cache_numbers.h"

namespace dapple::distribution {

using integrate::PointBatch;
using integrate::RaySet;
using integrate::RayTracer;
using trace::no_id;

void HitGatherer::find_lights(const Place& place, bool alone, int sets, ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  for (int set = 0; set < sets; ++set) {
    RaySet& r = b.ray_set(set);
    w.rays.diffuse += uint64_t(r.count);
    shading_.trace(r, w);
    if (alone) std::fill_n(r.glow, r.count, RGB());
    shading_.direct.add_lights_hit(b, r, place.list_depth());
  }
}

void HitGatherer::gather(const Place& place, int sets, ShadingWorkspace& w) const {
  find_lights(place, false, sets, w);
  answer(place, place.behind_diffuse(), cached_.growth(place), any_ray, sets, w);
  PointBatch& b = w.level(place.level);
  for (int set = 0; set < sets; ++set) b.ray_set(set).weigh();
}

void HitGatherer::look(const Place& place, int sets, ShadingWorkspace& w) const {
  find_lights(place, true, sets, w);
  PointBatch& b = w.level(place.level);
  for (int set = 0; set < sets; ++set) b.ray_set(set).weigh();
}

void HitGatherer::answer(const Place& place, const Place& below, float growth, RayFilter wanted, int sets,
                         ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  for (int set = 0; set < sets; ++set) {
    RaySet& r = b.ray_set(set);
    std::fill_n(r.cached, r.count, false);
    std::fill_n(r.glint, r.count, 0.0f);
  }
  if (cached_.serves(below.arrival))
    cached_.add(place, {below.level, {below.depth.diffuse, 0}, below.arrival}, growth, wanted, sets, w);
  const auto is_left = [&](const RaySet& r, int i) { return !r.cached[i] && wanted(r, i); };
  const bool coats = shading_.coats_mirror(below) && shading_.materials.any_coat();
  shade_hits(
      place, below, sets,
      [&](const RaySet& r, int i) { return is_left(r, i) && !(coats && keeps_layers(below, r, i)) ? 1.0f : 0.0f; }, w);
  if (coats) {
    shade_hits(
        place, {below.level, below.depth, Arrival::onward}, sets,
        [&](const RaySet& r, int i) { return is_left(r, i) && keeps_layers(below, r, i) ? 1.0f : 0.0f; }, w);
    add_coats(place, below, wanted, sets, w);
  }
  if (!shading_.scene.has_media()) return;
  for (int set = 0; set < sets; ++set) add_media(b.ray_set(set), below, wanted, w);
}

bool HitGatherer::keeps_layers(const Place& below, const RaySet& r, int i) const {
  const uint32_t geometry = r.hits.geometry[i];
  return shading_.coats_mirror(below) && r.share[i] > 1 && r.throughput[i] <= 1 &&
         shading_.materials.has_coat(geometry) && !shading_.materials.material(geometry).has_subsurface();
}

// What coats mirror of what they met; those that are lit count all, of which `onward` go on.
void HitGatherer::add_coats(const Place& place, const Place& below, RayFilter wanted, int sets,
                            ShadingWorkspace& w) const {
  const PointBatch& b = w.level(place.level);
  shade_hits(
      place, {below.level, below.depth, Arrival::coat}, sets,
      [&](const RaySet& r, int i) {
        if (!wanted(r, i) || !shading_.materials.has_coat(r.hits.geometry[i])) return 0.0f;
        if (!r.cached[i] && keeps_layers(below, r, i)) return 0.0f;
        return shading_.direct.glints() ? 1 : coat_weight(b, r, i);
      },
      w);
}

// One of so many rays goes on by the coat that it met, where it sees it at this angle: about as many as a coat mirrors.
float HitGatherer::coat_weight(const PointBatch& b, const RaySet& r, int i) const {
  const float cosine = dot(shading_.scene.traced.surface_without_tangents(r.rays, r.hits, i).Ns, r.rays.direction(i));
  const float chance = std::max(scattering::CommonCoat::reflectance(cosine), CacheNumbers::least_coats);
  return to_unit_float(random_of(b.key[r.point[i]], Purpose::coats, r.rays.key[i])) < chance ? 1 / chance : 0;
}

// In batches of all sets.
template <class Weight>
void HitGatherer::shade_hits(const Place& place, const Place& below, int sets, const Weight& weight,
                             ShadingWorkspace& w) const {
  PointBatch& b = w.level(place.level);
  PointBatch& found = w.level(below.level);
  float weights[PointBatch::capacity];
  const auto shade_found = [&] {
    if (found.count > 0) shader_.shade(below, w);
    for (int c = 0; c < found.count; ++c) {
      RaySet& r = b.ray_set(found.parent[c] / RaySet::capacity);
      const int i = found.parent[c] % RaySet::capacity;
      r.L.add(i, RGB(weights[c]), found.Ci.at(c));
      r.glint[i] += weights[c] * found.glint[c];
    }
    found.count = 0;
  };
  found.count = 0;
  for (int set = 0; set < sets; ++set) {
    const RaySet& r = b.ray_set(set);
    for (int i = 0; i < r.count; ++i) {
      if (r.hits.geometry[i] == no_id) continue;
      const float taken = weight(r, i);
      if (taken == 0 || r.weight[i].is_black()) continue;
      const int c = found.count++;
      weights[c] = taken;
      found.parent[c] = set * RaySet::capacity + i;
      set_hit(b, r, i, taken, below.arrival == Arrival::coat, found, c);
      if (found.count == PointBatch::capacity) shade_found();
    }
  }
  shade_found();
}

// Writes the inputs of point c of a batch: what ray i met, which counts `taken` times.
void HitGatherer::set_hit(const PointBatch& b, const RaySet& r, int i, float taken, bool coat, PointBatch& found,
                          int c) const {
  const int k = r.point[i];
  found.geometry[c] = r.hits.geometry[i];
  found.surface[c] = shading_.materials.needs_tangents(r.hits.geometry[i])
                         ? shading_.scene.traced.surface(r.hits, i, r.rays.time[i])
                         : shading_.scene.traced.surface_without_tangents(r.rays, r.hits, i);
  found.wo[c] = -r.rays.direction(i);
  found.set_one_time(c, r.rays.time[i]);
  found.spread[c] = widened(r.spread[i], taken);
  found.width[c] = b.width[k] + found.spread[c] * r.distance[i];
  found.medium[c] = r.medium[i];
  found.wavelength[c] = r.wavelength[i];
  const bool sheet = shading_.materials.is_sheet(r.hits.geometry[i]);
  const uint64_t key = sheet ? RayTracer::sheet_key(r.rays.key[i], r.sheets[i]) : hash(b.key[k], r.rays.key[i]);
  found.set_key(c, key, r.sequence[i], r.number[i]);
  found.share[c] = std::max(1, int(float(r.share[i]) / taken));
  found.crowd[c] = found.effort[c] = 1;
  found.set_no_cell(c);
  found.throughput[c] = r.throughput[i];
  found.onward[c] = coat && shading_.direct.glints() ? coat_weight(b, r, i) : 1;
}

void HitGatherer::add_media(RaySet& r, const Place& below, RayFilter wanted, ShadingWorkspace& w) const {
  PointBatch& in_media = w.level(below.level);
  in_media.count = 0;
  for (int f = 0; f < r.flights->count; ++f) {
    const int ray = r.flights->ray[f];
    if (wanted(r, ray)) set_flight(*r.flights, f, r.rays, r.share[ray], in_media, in_media.count++);
  }
  if (in_media.count == 0) return;
  shader_.shade_media(below, w);
  for (int k = 0; k < in_media.count; ++k) r.L.add(in_media.parent[k], in_media.Ci.at(k));
}

}  // namespace dapple::distribution
