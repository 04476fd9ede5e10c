// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/hider.h"

#include <algorithm>

#include "dapple/distribution/grid_numbers.h"

namespace dapple::distribution {

using integrate::CameraBatch;
using integrate::MaterialTable;
using integrate::PathSamples;
using integrate::RayTracer;
using trace::no_id;

namespace {

// Of still surfaces: no more than a pixel's samples tell apart, or diffuse rays can be shared among.
int most_segments(const DistributionSettings& s) {
  return std::min(std::max(4, s.pixel_samples / 4), s.shading.diffuse_rays.at(0));
}

bool sees_small(const CameraSample& s) {
  return s.source == Source::grid && PixelPoints::is_small(s.point.grid);
}

}  // namespace

void Hider::locate(const Box2i& pixels, uint32_t sample, const PixelSets& sets, CameraSamples& s,
                   ShadingWorkspace& w) const {
  s.camera.generate(shading_.scene, pixels, sample, sets);
  w.rays.camera += uint64_t(s.count());
  trace(s, w);
  locate_hits(s, w);
}

void Hider::locate_spread(uint32_t first, int n, uint64_t set, CameraSamples& s, ShadingWorkspace& w) const {
  s.camera.generate_spread(shading_.scene, first, n, set);
  trace(s, w);
  locate_hits(s, w);
}

void Hider::locate(const PathSamples& traced, CameraSamples& s, ShadingWorkspace& w) const {
  s.camera = traced.camera;
  start(s);
  const bool colored = shading_.scene.traced.has_colored_opacity();
  for (int p = 0; p < s.count(); ++p) {
    if (traced.left[p]) {
      s.hits.copy_lane(p, traced.hits, p);
      s.distance[p] = s.hits.t[p];
      s.passed[p] = s.camera.ray[p].weight * (colored ? s.hits.weight(p) : RGB(1));
    } else {
      s.hits.geometry[p] = no_id;
      s.distance[p] = 0;  // nothing is left to do there
      s.L.set(p, traced.L.at(p));
    }
  }
  locate_hits(s, w);
  for (int p = 0; p < s.count(); ++p) {
    if (traced.left[p]) continue;
    s.sample[p].source = Source::path;
    s.sample[p].direct = traced.direct[p];
    s.sample[p].features = traced.features[p];
  }
}

bool Hider::sees_small_patches(const CameraSamples& s) const {
  return std::any_of(s.sample, s.sample + s.count(), sees_small);
}

void Hider::choose_points(const Box2i& pixels, const PixelSets& sets, Chosen& chosen, CameraSamples& s,
                          ShadingWorkspace& w) const {
  chosen.points.clear();
  // A crop shows that part of the whole: what pixels beyond it choose counts too.
  const Box2i block = CameraBatch::block_around(pixels, shading_.scene.film.resolution);
  for (uint32_t first = 0; first < std::min(uint32_t(settings_.pixel_samples), GridNumbers::first_samples); ++first) {
    locate(block, first, sets, s, w);
    for (int p = 0; p < s.count(); ++p)
      if (sees_small(s.sample[p]))
        chosen.points.consider(shading_.scene, CameraBatch::in_block(s.camera.pixel[p]), settings_.pixel_points,
                               s.sample[p].point);
  }
  chosen.points.close();
  chosen.known = true;
}

void Hider::lend_points(const Chosen& chosen, CameraSamples& s) const {
  for (int p = 0; p < s.count(); ++p)
    if (sees_small(s.sample[p]))
      chosen.points.lend(shading_.scene, CameraBatch::in_block(s.camera.pixel[p]), settings_.pixel_points,
                         hash(s.camera.seed[p], s.camera.index[p]), &s.sample[p].point);
}

// Of all samples: their rays from the camera, which have met nothing.
void Hider::start(CameraSamples& s) const {
  const CameraBatch& c = s.camera;
  const float share = 1 / std::sqrt(float(settings_.pixel_samples));  // of the pixel's footprint
  for (int p = 0; p < s.count(); ++p) {
    const Ray& r = c.ray[p].ray;
    s.rays.set(p, r.o, r.d, infinity, r.time, trace::ray_key(c.seed[p], c.index[p]), c.ray[p].cone_width * share,
               c.ray[p].cone_spread * share);
    s.medium[p] = shading_.scene.camera_medium;
    s.L.clear(p);
  }
}

void Hider::trace(CameraSamples& s, ShadingWorkspace& w) const {
  start(s);
  RayTracer::Flights* const flights = shading_.scene.has_media() ? &s.flights : nullptr;
  if (const light::ShaftLight* shafts = shading_.settings.shafts.get()) {
    s.flights.certain = shafts->medium();
    s.flights.scatters = !shafts->single();
  }
  const Timer timer;
  shading_.tracer.nearest(s.rays, s.count(), s.medium, &s.hits, s.distance, s.passed, w.tracing, flights);
  w.stages.tracing_seconds += timer.seconds();
  for (int p = 0; p < s.count(); ++p) s.passed[p] *= s.camera.ray[p].weight;
}

void Hider::locate_hits(CameraSamples& samples, ShadingWorkspace& w) const {
  for (int p = 0; p < samples.count(); ++p) {
    CameraSample& s = samples.sample[p];
    s.pixel = samples.camera.pixel[p];
    s.film_weight = samples.camera.film_weight[p];
    s.source = Source::nothing;
    s.d = samples.rays.direction(p);
    s.geometry = samples.hits.geometry[p];
    if (!(samples.camera.ray[p].weight > 0)) continue;  // stopped in the lens
    if (s.geometry == no_id) {
      if (samples.distance[p] < infinity) continue;
      shading_.direct.add_environment(samples.rays.origin(p), s.d, samples.L, p);
      samples.L.scale(p, samples.passed[p]);
      continue;
    }
    const scene::CameraRay& r = samples.camera.ray[p];
    s.seed = samples.camera.seed[p], s.index = samples.camera.index[p];
    s.time = r.ray.time, s.spread = r.cone_spread;
    s.width = r.cone_width + r.cone_spread * samples.distance[p];
    s.passed = samples.passed[p];
    s.medium = samples.medium[p];
    const bool tangents =
        needs_tangents(s.geometry) || shading_.scene.emitter_index(s.geometry, samples.hits.primitive[p]) != no_id;
    s.surface = tangents ? shading_.scene.traced.surface(samples.hits, p, s.time)
                         : shading_.scene.traced.surface_without_tangents(samples.rays, samples.hits, p);
    shading_.direct.add_emission(samples.hits, p, s.surface, s.d, samples.L, p);
    samples.L.scale(p, samples.passed[p]);
    s.refined = false;
    s.source = is_gridded(s.geometry) && dice(p, 1, samples, w) ? Source::grid : Source::hit;
  }
}

bool Hider::dice(int p, float finer, CameraSamples& samples, ShadingWorkspace& w) const {
  CameraSample& s = samples.sample[p];
  const bool diced = std::holds_alternative<trace::GridsPtr>(shading_.scene.traced.shape(s.geometry));
  const float width = s.width * std::sqrt(settings_.shading_rate) * (diced ? GridNumbers::diced_spacing : 1) / finer;
  if (!shading_.patches->dice(shading_.patches->patch_hit(samples.hits, p, s.d, s.time, s.surface, &w.extents), width,
                              &s.point))
    return false;
  if (shading_.surface_media.by_ray()) s.point.grid.medium = shading_.surface_media.name(s.geometry, s.medium);
  if (shading_.patches->motion().any() && !shading_.patches->motion().moves(samples.hits.instance[p], s.geometry))
    s.point.grid.span = shading_.patches->motion().span_seen(samples.rays.origin(p), s.d, samples.distance[p], width,
                                                             s.time, most_segments(settings_));
  return true;
}

}  // namespace dapple::distribution
