// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/distribution_integrator.h"

#include <algorithm>
#include <utility>

#include "dapple/base/parallel.h"
#include "dapple/distribution/distribution_workspace.h"
#include "dapple/integrate/ray_origin.h"
#include "dapple/vegetation/mask_scene.h"

namespace dapple::distribution {

using gi::CacheAnswers;
using gi::CacheLog;
using gi::CacheLogs;
using gi::RadiosityCache;
using integrate::CacheCounts;
using integrate::CacheState;
using integrate::CameraBatch;
using integrate::Integrator;
using integrate::MaterialTable;
using integrate::PointBatch;
using integrate::RayTracer;
using integrate::Resolution;
using integrate::resolution_count;
using integrate::resolution_names;
using integrate::TileWork;
using scene::GridId;
using trace::no_id;
using vegetation::mask_cache;

namespace {
// Points of diced surfaces, which are displaced or curved, stand closer by this: points that bumps hide share in what
// is seen between them.
constexpr float diced_spacing = 0.8f;

// Of still surfaces: no more than a pixel's samples tell apart, or diffuse rays can be shared among.
int most_segments(const DistributionIntegrator::Settings& s) {
  return std::min(std::max(4, s.pixel_samples / 4), s.shading.diffuse_rays.at(0));
}

bool has_subsurface(const scene::Scene& scene) {
  return std::any_of(scene.materials.begin(), scene.materials.end(), [](const auto& m) { return m->has_subsurface(); });
}

HitShader::Settings with_masks(const DistributionIntegrator::Settings& settings) {
  HitShader::Settings s = settings.shading;
  if (settings.masks) s.visibility = settings.masks.get();
  if (settings.far_ground) s.visibility = settings.far_ground.get();
  return s;
}
}  // namespace

DistributionIntegrator::CacheUse::CacheUse(const scene::Scene& scene, const Settings& s)
    : subsurface(s.subsurface_cache && has_subsurface(scene)),
      hemispheres(s.irradiance_interpolation && s.shading.bounces > 0),
      subsurface_bytes(subsurface ? s.cache_bytes / 4 : 0),
      hemisphere_bytes(hemispheres ? s.cache_bytes / 7 : 0),
      radiosity_bytes(s.cache_bytes - subsurface_bytes - hemisphere_bytes) {}

DistributionIntegrator::DistributionIntegrator(const scene::Scene& scene, const Settings& settings)
    : scene_(scene),
      settings_(settings),
      groups_(settings.light_groups ? int(scene.light_groups.names.size()) : 0),
      patches_(scene.traced, scene::Motion(scene)),
      use_(scene, settings),
      irradiance_(use_.subsurface ? std::make_unique<RadiosityCache>(use_.subsurface_bytes, groups_) : nullptr),
      radiosity_(settings.radiosity_cache ? std::make_unique<RadiosityCache>(use_.radiosity_bytes, groups_) : nullptr),
      shader_(scene, with_masks(settings), &patches_, radiosity_.get(), irradiance_.get()),
      grids_(settings.grid_bytes, groups_),
      logs_(settings.log_caches && radiosity_ ? std::make_unique<CacheLogs>() : nullptr) {
  if (!use_.hemispheres) return;
  const IrradianceInterpolator::Settings s{settings.shading.diffuse_rays.at(0), settings.irradiance_accuracy,
                                           use_.hemisphere_bytes, groups_};
  interpolator_ = std::make_unique<IrradianceInterpolator>(shader_, patches_, s);
}

std::vector<CacheState> DistributionIntegrator::caches() const {
  std::vector<CacheState> states;
  states.push_back(grids_.state());
  if (interpolator_) states.push_back(interpolator_->state());
  const auto add = [&states](const char* name, const RadiosityCache& cache) {
    for (int r = 0; r < resolution_count; ++r) {
      states.push_back(cache.state(Resolution(r)));
      states.back().name = std::string(name) + "." + std::string(resolution_names[size_t(r)]);
    }
  };
  if (irradiance_) add("irradiance", *irradiance_);
  if (!radiosity_) return with_mask_state(std::move(states));
  add("radiosity", *radiosity_);
  for (int d = first_cached_depth(); d <= settings_.shading.bounces; ++d)
    states.push_back({.name = "radiosity.depth" + std::to_string(d), .has_memory = false});
  return with_mask_state(std::move(states));
}

std::vector<CacheState> DistributionIntegrator::with_mask_state(std::vector<CacheState> states) const {
  if (settings_.masks) states.push_back(mask_cache(*settings_.masks));
  return states;
}

std::unique_ptr<Integrator::Workspace> DistributionIntegrator::make_workspace() const {
  auto w = std::make_unique<DistributionWorkspace>(groups_);
  w->caches.resize(caches().size());
  for (RadiosityCache::Counts* c : {&w->shading.caches, &w->shading.irradiance_caches})
    c->by_depth.resize(size_t(settings_.shading.bounces) + 1);
  if (interpolator_) w->interpolation = std::make_unique<IrradianceInterpolator::Workspace>(*interpolator_);
  if (logs_) w->shading.cache_log = logs_->add();
  return w;
}

void DistributionIntegrator::render(const TileWork& work, Workspace& workspace, scene::Film& film) const {
  auto& w = static_cast<DistributionWorkspace&>(workspace);
  w.shading.tracing.stop = work.stop;
  w.sets = PixelSets(work.pixel_samples, settings_.shading.seed);
  CameraBatch::for_each_block(work.pixels, [&](const Box2i& box) {
    w.seen_known = false;
    w.held.clear();
    std::fill_n(w.found, DistributionWorkspace::found_count, 0u);
    for (uint32_t i = 0; i < work.sample_count; ++i) {
      locate_samples(box, work.first_sample + i, w);
      w.rays.camera += uint64_t(w.camera.count);
      if (chooses_points()) lend_points(box, work.first_sample + i, w);
      if (scene_.has_media()) add_media(w);
      find_points(w);
      finish_ready(w, film);
    }
  });
  collect_counts(w);
}

void DistributionIntegrator::finish(std::span<const std::unique_ptr<Workspace>> workspaces, scene::Film& film) const {
  shade_all_claimed(workspaces);
  parallel_for(workspaces.size(), [&](size_t i) {
    auto& w = static_cast<DistributionWorkspace&>(*workspaces[i]);
    finish_waiting(w, film);
    collect_counts(w);
  });
}

void DistributionIntegrator::collect_counts(DistributionWorkspace& w) const {
  w.rays += std::exchange(w.shading.rays, {});
  w.stages += std::exchange(w.shading.stages, {});
  CacheCounts* to = w.caches.data() + 1;
  if (interpolator_) *to++ += std::exchange(w.interpolation->counts, {});
  if (irradiance_)
    for (CacheCounts& c : w.shading.irradiance_caches.by_resolution) *to++ += std::exchange(c, {});
  if (!radiosity_) return;
  for (CacheCounts& c : w.shading.caches.by_resolution) *to++ += std::exchange(c, {});
  for (int d = first_cached_depth(); d <= settings_.shading.bounces; ++d)
    *to++ += std::exchange(w.shading.caches.by_depth[size_t(d)], {});
}

// Which shading points one sample of each pixel sees.
void DistributionIntegrator::locate_samples(const Box2i& pixels, uint32_t sample, DistributionWorkspace& w) const {
  w.camera.generate(scene_, pixels, sample, w.sets);
  trace_camera_rays(w);
  locate_hits(w);
}

// Else a pixel's samples see no more than may be shaded.
bool DistributionIntegrator::chooses_points() const {
  return settings_.pixel_points > 0 &&
         settings_.pixel_points <= std::min(settings_.pixel_samples, int(PixelPoints::first_samples));
}

// Small patches, leaves say: however many of them a pixel's samples see, a few are shaded. Which, follows from the
// scene and the first samples, which each pass traces once more: that costs less than to keep it.
void DistributionIntegrator::lend_points(const Box2i& pixels, uint32_t sample, DistributionWorkspace& w) const {
  const auto is_small = [&w](int p) {
    return w.sample[p].source == Source::grid && PixelPoints::is_small(w.sample[p].point.grid);
  };
  bool any = false;
  for (int p = 0; p < w.camera.count; ++p) any |= is_small(p);
  if (!any) return;
  if (!w.seen_known) {
    w.seen.clear();
    // A crop shows that part of the whole: what pixels beyond it choose counts too.
    const Box2i block = CameraBatch::block_around(pixels, scene_.film.resolution);
    for (uint32_t s = 0; s < std::min(uint32_t(settings_.pixel_samples), PixelPoints::first_samples); ++s) {
      locate_samples(block, s, w);
      w.rays.camera += uint64_t(w.camera.count);
      for (int p = 0; p < w.camera.count; ++p)
        if (is_small(p))
          w.seen.consider(scene_, CameraBatch::in_block(w.camera.pixel[p]), settings_.pixel_points, w.sample[p].point);
    }
    w.seen.close();
    w.seen_known = true;
    locate_samples(pixels, sample, w);
    w.rays.camera += uint64_t(w.camera.count);
  }
  for (int p = 0; p < w.camera.count; ++p)
    if (is_small(p)) {
      const int pixel = CameraBatch::in_block(w.camera.pixel[p]);
      w.seen.lend(scene_, pixel, settings_.pixel_points, hash(w.camera.seed[p], w.camera.index[p]), &w.sample[p].point);
    }
}

void DistributionIntegrator::trace_camera_rays(DistributionWorkspace& w) const {
  const CameraBatch& c = w.camera;
  const float share = 1 / std::sqrt(float(settings_.pixel_samples));  // of the pixel's footprint
  for (int p = 0; p < c.count; ++p) {
    const Ray& r = c.ray[p].ray;
    w.camera_rays.set(p, r.o, r.d, infinity, r.time, trace::ray_key(c.seed[p], c.index[p]), c.ray[p].cone_width * share,
                      c.ray[p].cone_spread * share);
    w.medium[p] = scene_.camera_medium;
    w.L.clear(p);
  }
  RayTracer::Flights* const flights = scene_.has_media() ? &w.flights : nullptr;
  const Timer timer;
  shader_.tracer().nearest(w.camera_rays, c.count, w.medium, &w.hits, w.distance, w.passed, w.shading.tracing, flights);
  w.shading.stages.tracing_seconds += timer.seconds();
}

// Adds what camera rays meet that shines, and says which tile of shading points serves each hit.
void DistributionIntegrator::locate_hits(DistributionWorkspace& w) const {
  const MaterialTable& materials = shader_.materials();
  for (int p = 0; p < w.camera.count; ++p) {
    CameraSample& s = w.sample[p];
    s.pixel = w.camera.pixel[p];
    s.film_weight = w.camera.film_weight[p];
    s.source = Source::nothing;
    s.d = w.camera_rays.direction(p);
    s.geometry = w.hits.geometry[p];
    if (s.geometry == no_id) {
      if (w.distance[p] < infinity) continue;
      shader_.direct().add_environment(w.camera_rays.origin(p), s.d, w.L, p);
      w.L.scale(p, w.passed[p]);
      continue;
    }
    const scene::CameraRay& r = w.camera.ray[p];
    s.seed = w.camera.seed[p], s.index = w.camera.index[p];
    s.time = r.ray.time, s.spread = r.cone_spread;
    s.width = r.cone_width + r.cone_spread * w.distance[p];
    s.passed = w.passed[p];
    s.medium = w.medium[p];
    const bool tangents =
        needs_tangents_where_seen(s.geometry) || scene_.emitter_index(s.geometry, w.hits.primitive[p]) != no_id;
    s.surface = tangents ? scene_.traced.surface(w.hits, p, s.time)
                         : scene_.traced.surface_without_tangents(w.camera_rays, w.hits, p);
    shader_.direct().add_emission(w.hits, p, s.surface, s.d, w.L, p);
    w.L.scale(p, w.passed[p]);
    // A random choice would be made once for a shading point, however many samples see it.
    s.refined = false;
    s.source = !materials.is_random(s.geometry) && dice(p, 1, w) ? Source::grid : Source::hit;
  }
}

// Names the tile of shading points that serves a sample; `finer`: than its pixel asks for, in length.
bool DistributionIntegrator::dice(int p, float finer, DistributionWorkspace& w) const {
  CameraSample& s = w.sample[p];
  const bool diced = std::holds_alternative<trace::GridsPtr>(scene_.traced.shape(s.geometry));
  const float width = s.width * std::sqrt(settings_.shading_rate) * (diced ? diced_spacing : 1) / finer;
  if (!patches_.dice(patches_.patch_hit(w.hits, p, s.d, s.time, s.surface, &w.shading.extents), width, &s.point))
    return false;
  if (shader_.surface_media().by_ray()) s.point.grid.medium = shader_.surface_media().name(s.geometry, s.medium);
  if (patches_.motion().any() && !patches_.motion().moves(w.hits.instance[p], s.geometry))
    s.point.grid.span = patches_.motion().span_seen(w.camera_rays.origin(p), s.d, w.distance[p], width, s.time,
                                                    most_segments(settings_));
  return true;
}

void DistributionIntegrator::add_media(DistributionWorkspace& w) const {
  for (int p = 0; p < w.camera.count; ++p) w.L.add(p, w.flights.emitted[p], 0);
  PointBatch& b = w.shading.level(sample_level);
  b.count = w.flights.count;
  for (int f = 0; f < b.count; ++f) HitShader::set_flight(w.flights, f, w.camera_rays, sharing_samples(), b, f);
  shader_.shade_media({sample_level, {}, HitShader::Arrival::view}, w.shading);
  for (int k = 0; k < b.count; ++k) w.L.add(b.parent[k], w.passed[b.parent[k]], b.Ci.at(k));
}

// The rays that shading points send are functions of their names: sent once more, they say what answered them.
void DistributionIntegrator::view_caches(uint32_t pixel_samples, scene::Film& film) const {
  if (!logs_ || settings_.shading.bounces == 0) return;
  const double seconds = logs_->now();
  const CacheLog log = logs_->merged();
  std::vector<Box2i> strips;
  const Box2i& crop = film.settings().crop;
  for (int y = crop.min.y; y < crop.max.y; y += 2 * CameraBatch::block)
    strips.push_back({V2i(crop.min.x, y), V2i(crop.max.x, std::min(y + 2 * CameraBatch::block, crop.max.y))});
  parallel_for(strips.size(), [&](size_t i) {
    const std::unique_ptr<Workspace> made = make_workspace();
    auto& w = static_cast<DistributionWorkspace&>(*made);
    w.sets = PixelSets(pixel_samples, settings_.shading.seed);
    CameraBatch::for_each_block(strips[i], [&](const Box2i& box) { view_block(box, log, seconds, w, film); });
  });
}

void DistributionIntegrator::view_block(const Box2i& pixels, const CacheLog& log, double seconds,
                                        DistributionWorkspace& w, scene::Film& film) const {
  w.held.clear();
  std::fill_n(w.found, DistributionWorkspace::found_count, 0u);
  locate_samples(pixels, 0, w);
  int n = 0;
  for (int p = 0; p < w.camera.count; ++p)
    if (w.sample[p].source == Source::grid) w.order[n++] = p;
  find_grids(n, w);
  PointBatch& b = w.shading.level(sample_level);
  for (const Source source : {Source::grid, Source::hit}) {
    b.count = 0;
    for (int p = 0; p < w.camera.count; ++p) {
      if (w.sample[p].source != source) continue;
      const int k = b.count++;
      b.parent[k] = p;
      if (source == Source::hit) {
        set_point(w.sample[p], b, k);
        continue;
      }
      const SeenGrid grid = seen_grid(*w.sample[p].grid, w);
      const int point = patches_.neighbours(w.sample[p].point).nearest;
      set_grid_point(grid, point % grid.id.width(), point / grid.id.width(), b, k, w);
    }
    if (b.count == 0) continue;
    const HitShader::Place place{sample_level, {}, HitShader::Arrival::view};
    shader_.prelight(place, w.shading);
    CacheAnswers answers[PointBatch::capacity];
    shader_.survey(place, log, answers, w.shading);
    for (int k = 0; k < b.count; ++k) {
      const V2i& pixel = w.camera.pixel[b.parent[k]];
      film.set_cache_use(pixel.x, pixel.y, answers[k].means(seconds));
    }
  }
}

}  // namespace dapple::distribution
