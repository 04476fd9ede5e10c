// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/distribution_integrator.h"

#include <algorithm>
#include <atomic>
#include <deque>
#include <stdexcept>
#include <utility>

#include "dapple/base/parallel.h"
#include "dapple/distribution/cache_numbers.h"
#include "dapple/distribution/cache_survey.h"
#include "dapple/distribution/distribution_workspace.h"
#include "dapple/distribution/small_bodies.h"
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
using integrate::PathSamples;
using integrate::PointBatch;
using integrate::Resolution;
using integrate::resolution_count;
using integrate::resolution_names;
using integrate::TileWork;
using shading::Stage;
using vegetation::mask_cache;

namespace {
bool has_subsurface(const scene::Scene& scene) {
  return std::any_of(scene.materials.begin(), scene.materials.end(), [](const auto& m) { return m->has_subsurface(); });
}

ShadingSettings with_masks(const DistributionIntegrator::Settings& settings) {
  ShadingSettings s = settings.shading;
  if (settings.masks) s.visibility = settings.masks.get();
  if (settings.far_ground) s.visibility = settings.far_ground.get();
  return s;
}
}  // namespace

DistributionIntegrator::MemoryShares::MemoryShares(const scene::Scene& scene, const Settings& s)
    : subsurface(s.subsurface_cache && has_subsurface(scene)),
      hemispheres(s.irradiance_interpolation && s.shading.bounces > 0),
      subsurface_bytes(subsurface ? s.cache_bytes / 4 : 0),
      hemisphere_bytes(hemispheres ? s.cache_bytes / 7 : 0),
      radiosity_bytes(s.cache_bytes - subsurface_bytes - hemisphere_bytes) {}

DistributionIntegrator::DistributionIntegrator(const scene::Scene& scene, const Settings& settings)
    : scene_(scene),
      settings_(settings),
      groups_(settings.light_groups ? int(scene.light_groups.names.size()) : 0),
      patches_(scene.traced, scene::Motion(scene), scene.patches.get()),
      shares_(scene, settings),
      irradiance_(shares_.subsurface ? std::make_unique<RadiosityCache>(shares_.subsurface_bytes, groups_) : nullptr),
      radiosity_(settings.radiosity_cache ? std::make_unique<RadiosityCache>(shares_.radiosity_bytes, groups_)
                                          : nullptr),
      shading_(scene, with_masks(settings), &patches_),
      placer_(shading_),
      shader_(shading_, placer_, radiosity_.get(), irradiance_.get()),
      interpolator_(shares_.hemispheres ? make_interpolator() : nullptr),
      grids_(settings.grid_bytes, groups_),
      hider_(shading_, settings_),
      finder_(shading_, hider_, settings_, grids_),
      grid_shader_(shading_, placer_, shader_, interpolator_.get(), settings_),
      finisher_(shading_, shader_, settings_, groups_),
      logs_(settings.log_caches && radiosity_ ? std::make_unique<CacheLogs>() : nullptr) {
  if (settings.visible_points == VisiblePoints::samples && radiosity_) survey_readers();
  if (radiosity_) answers_.emplace(shading_, shader_, *radiosity_, groups_);
  not_for_paths_ = find_small_bodies(scene);
  for (uint32_t g = 0; g < scene.bindings.size(); ++g)
    not_for_paths_[g] = !not_for_paths_[g] && hider_.is_left_by_paths(g);
}

void DistributionIntegrator::survey_readers() {
  const auto map_of = [](const auto& found) { return std::shared_ptr<const ReaderMap>(found, &found->map); };
  if (settings_.readers) {
    readers_ = settings_.readers;
    shading_.readers = map_of(readers_);
    return;
  }
  const auto found = std::make_shared<SurveyedReaders>();
  shading_.readers = map_of(found);
  ReaderSurvey(shading_, placer_, shader_, hider_, finisher_, settings_).fill(found.get());
  readers_ = found;
}

// Paths do without the stages that see light, wherever they meet such a shader.
bool DistributionIntegrator::samples_may_be_paths() const {
  const auto sees_light = [](const auto& material) {
    const shading::StageSet stages = material->stages();
    return stages.has(Stage::diffuselighting) || stages.has(Stage::specularlighting) || stages.has(Stage::postlighting);
  };
  const auto is_left = [](uint8_t left) { return left != 0; };
  return settings_.visible_points == VisiblePoints::samples && radiosity_ && !logs_ &&
         // Between the camera and what paths leave nothing scatters.
         (scene_.camera_medium == scene::vacuum ||
          std::none_of(not_for_paths_.begin(), not_for_paths_.end(), is_left)) &&
         // Paths follow metal and coats; these count as diffuse here.
         (settings_.shading.caustics || !readers_->view_dependent) &&
         std::none_of(scene_.materials.begin(), scene_.materials.end(), sees_light);
}

void DistributionIntegrator::set_paths(std::unique_ptr<const integrate::CameraPaths> paths) {
  paths_ = std::move(paths);
  const std::vector<CacheState> all = caches();
  for (const CacheState& c : paths_->caches()) {
    const auto same = std::find_if(all.begin(), all.end(), [&c](const CacheState& a) { return a.name == c.name; });
    if (same == all.end()) throw std::logic_error("a cache of paths that nobody counts: " + c.name);
    cache_of_paths_.push_back(size_t(same - all.begin()));
  }
}

std::unique_ptr<const IrradianceInterpolator> DistributionIntegrator::make_interpolator() const {
  const IrradianceInterpolator::Settings s{settings_.shading.diffuse_rays.at(0), settings_.irradiance_accuracy,
                                           shares_.hemisphere_bytes, groups_};
  return std::make_unique<IrradianceInterpolator>(shading_, placer_, shader_.diffuse_rays(), shader_.gatherer(), s);
}

void DistributionIntegrator::begin_again() const {
  grids_.clear();
  if (paths_) paths_->begin_again();
}

std::vector<CacheState> DistributionIntegrator::caches() const {
  std::vector<CacheState> states;
  states.push_back(grids_.state());
  if (interpolator_) states.push_back(interpolator_->state());
  for (int r = 0; irradiance_ && r < resolution_count; ++r) {
    states.push_back(irradiance_->state(Resolution(r)));
    states.back().name = "irradiance." + std::string(resolution_names[size_t(r)]);
  }
  if (!radiosity_) return with_mask_state(std::move(states));
  for (CacheState& s : PathAnswers::states(*radiosity_, first_cached_depth(), settings_.shading.bounces))
    states.push_back(std::move(s));
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
  if (interpolator_) w->grids.interpolation = std::make_unique<IrradianceInterpolator::Workspace>(*interpolator_);
  if (logs_) w->shading.cache_log = logs_->add();
  if (paths_) {
    w->paths = paths_->make_workspace();
    w->path_samples = std::make_unique<PathSamples>(groups_);
  }
  return w;
}

void DistributionIntegrator::render(const TileWork& work, Workspace& workspace, scene::Film& film) const {
  auto& w = static_cast<DistributionWorkspace&>(workspace);
  w.shading.tracing.stop = work.stop;
  w.sets = PixelSets(work.pixel_samples, settings_.shading.seed);
  CameraBatch::for_each_block(work.pixels, [&](const Box2i& box) {
    w.begin_block();
    for (uint32_t i = 0; i < work.sample_count; ++i) {
      const uint32_t sample = work.first_sample + i;
      if (paths_) trace_paths(box, sample, work.stop, w, film);
      locate(box, sample, w);
      if (settings_.chooses_points() && hider_.sees_small_patches(w.camera)) {
        if (!w.chosen.known) {
          hider_.choose_points(box, w.sets, w.chosen, w.camera, w.shading);
          locate(box, sample, w);
        }
        hider_.lend_points(w.chosen, w.camera);
      }
      if (scene_.has_media() && !paths_) add_media(w, film);
      finder_.find_points(w.camera, w.finder, w.claimed, w.shading);
      finisher_.add(w.camera, w.finder.held, w.finisher, w.shading, film);
      shade_when_it_pays(w, film);
    }
  });
  collect_counts(w);
}

void DistributionIntegrator::trace_paths(const Box2i& pixels, uint32_t sample, const StopToken& stop,
                                         DistributionWorkspace& w, scene::Film& film) const {
  PathSamples& s = *w.path_samples;
  s.camera.generate(scene_, pixels, sample, w.sets);
  paths_->trace(not_for_paths_, film.settings(), stop, s, *w.paths);
  for (int p = 0; film.settings().air && p < s.camera.count; ++p)
    film.add_air(s.camera.pixel[p].x, s.camera.pixel[p].y, s.camera.film_weight[p],
                 s.left[p] ? scene::AirFeatures() : s.air[p]);
}

void DistributionIntegrator::locate(const Box2i& pixels, uint32_t sample, DistributionWorkspace& w) const {
  if (paths_)
    hider_.locate(*w.path_samples, w.camera, w.shading);
  else
    hider_.locate(pixels, sample, w.sets, w.camera, w.shading);
}

void DistributionIntegrator::finish(std::span<const std::unique_ptr<Workspace>> workspaces, scene::Film& film) const {
  shade_all_claimed(workspaces);
  parallel_for(workspaces.size(), [&](size_t i) {
    auto& w = static_cast<DistributionWorkspace&>(*workspaces[i]);
    finish_all(w, film);
    collect_counts(w);
  });
}

void DistributionIntegrator::collect_counts(DistributionWorkspace& w) const {
  w.rays += std::exchange(w.shading.rays, {});
  w.stages += std::exchange(w.shading.stages, {});
  if (paths_) {
    w.rays += std::exchange(w.paths->rays, {});
    w.stages += std::exchange(w.paths->stages, {});
    w.shafts += std::exchange(w.paths->shafts, {});
    for (size_t c = 0; c < cache_of_paths_.size(); ++c)
      w.caches[cache_of_paths_[c]] += std::exchange(w.paths->caches[c], {});
  }
  CacheCounts* to = w.caches.data();
  *to += std::exchange(w.finder.counts, {});
  to++->fill_seconds += std::exchange(w.grids.seconds, 0);
  if (interpolator_) *to++ += std::exchange(w.grids.interpolation->counts, {});
  if (irradiance_)
    for (CacheCounts& c : w.shading.irradiance_caches.by_resolution) *to++ += std::exchange(c, {});
  if (!radiosity_) return;
  PathAnswers::collect(w.shading.caches, first_cached_depth(), settings_.shading.bounces, to);
}

void DistributionIntegrator::shade_when_it_pays(DistributionWorkspace& w, scene::Film& film) const {
  const WaitingSamples& waiting = w.finisher.waiting;
  if (waiting.is_full()) {
    finish_all(w, film);
  } else if (w.claimed.count() >= PointBatch::capacity || waiting.hits >= PointBatch::capacity) {
    grid_shader_.shade(PointBatch::capacity - 1, w.claimed, w.grids, w.shading);
    finisher_.finish_waiting(w.finisher, w.shading, film);
  }
}

// Points that other threads have claimed and not begun are shaded here: those threads may have run out of pixels.
void DistributionIntegrator::finish_all(DistributionWorkspace& w, scene::Film& film) const {
  grid_shader_.shade(0, w.claimed, w.grids, w.shading);
  for (const auto& waiting : w.finisher.waiting.samples) {
    if (waiting.sample.source != Source::grid) continue;
    if (const ShadingGrid::Parts mine = waiting.grid->take(waiting.grid->unready(waiting.sample.wanted)))
      w.claimed.add(waiting.grid, mine, true);
  }
  grid_shader_.shade(0, w.claimed, w.grids, w.shading);
  for (const auto& waiting : w.finisher.waiting.samples)
    if (waiting.sample.source == Source::grid) waiting.grid->wait(waiting.sample.wanted);
  finisher_.finish_waiting(w.finisher, w.shading, film);
}

// Shades what all threads have claimed, in batches that are full but not so large that some threads would have nothing
// to do.
void DistributionIntegrator::shade_all_claimed(std::span<const std::unique_ptr<Workspace>> workspaces) const {
  constexpr int at_a_time = 128;
  std::deque<ClaimedPoints> jobs;
  for (const auto& of : workspaces) {
    ClaimedPoints& claimed = static_cast<DistributionWorkspace&>(*of).claimed;
    while (claimed.count() > 0) claimed.give(at_a_time, &jobs.emplace_back());
  }
  std::atomic<size_t> next{0};
  parallel_for(workspaces.size(), [&](size_t i) {
    auto& w = static_cast<DistributionWorkspace&>(*workspaces[i]);
    for (size_t job; (job = next++) < jobs.size();) {
      jobs[job].give(at_a_time, &w.claimed);
      grid_shader_.shade(0, w.claimed, w.grids, w.shading);
    }
  });
}

void DistributionIntegrator::add_media(DistributionWorkspace& w, scene::Film& film) const {
  CameraSamples& s = w.camera;
  for (int p = 0; p < s.count(); ++p) s.L.add(p, s.flights.emitted[p] * s.camera.ray[p].weight, 0);
  for (const auto& lit : s.flights.lit) s.L.add(lit.ray, lit.radiance * s.camera.ray[lit.ray].weight, 0);
  PointBatch& b = w.shading.level(sample_level);
  b.count = s.flights.count;
  for (int f = 0; f < b.count; ++f) set_flight(s.flights, f, s.rays, settings_.sharing_samples(), b, f);
  shader_.shade_media({sample_level, {}, Arrival::view}, w.shading);
  const light::ShaftLight* const shafts = settings_.shading.shafts.get();
  for (int k = 0; k < b.count; ++k)
    s.L.add(b.parent[k], shafts ? s.flights.weight[k] * s.camera.ray[b.parent[k]].weight : s.passed[b.parent[k]],
            b.Ci.at(k));
  if (!shafts) return;
  scene::AirFeatures air[CameraSamples::capacity];
  for (const integrate::RayTracer::Flights::Way& way : s.flights.ways) {
    const Ray ray{s.camera.ray[way.ray].ray.o + way.d * way.begin, way.d, infinity, 0};
    const float length = way.end - way.begin;
    shafts->in_scattering({ray.o, ray.d, length, s.camera.seed[way.ray], s.camera.index[way.ray]}, &w.shafts,
                          [&](uint32_t light, const RGB& L) {
                            const RGB brought = way.passed * L * s.camera.ray[way.ray].weight;
                            s.L.add(way.ray, brought, shading_.direct.group(light));
                            air[way.ray].airlight += brought;
                          });
    if (film.settings().air) air[way.ray].transmittance *= way.transmittance;
  }
  for (int p = 0; p < s.count() && film.settings().air; ++p)
    film.add_air(s.camera.pixel[p].x, s.camera.pixel[p].y, s.camera.film_weight[p], air[p]);
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
  w.begin_block();
  CameraSamples& s = w.camera;
  hider_.locate(pixels, 0, w.sets, s, w.shading);
  finder_.find_grids(s, w.finder, w.shading);
  const CacheSurvey survey(shading_, shader_, log);
  PointBatch& b = w.shading.level(sample_level);
  for (const Source source : {Source::grid, Source::hit}) {
    b.count = 0;
    for (int p = 0; p < s.count(); ++p) {
      if (s.sample[p].source != source) continue;
      const int k = b.count++;
      b.parent[k] = p;
      if (source == Source::hit)
        finisher_.set_point(s.sample[p], b, k);
      else
        grid_shader_.set_point(*s.sample[p].grid, patches_.neighbours(s.sample[p].point).nearest, b, k, w.grids,
                               w.shading);
    }
    if (b.count == 0) continue;
    const Place place{sample_level, {}, Arrival::view};
    shader_.prelight(place, w.shading);
    CacheAnswers answers[PointBatch::capacity];
    survey.ask(place, answers, w.shading);
    for (int k = 0; k < b.count; ++k) {
      const V2i& pixel = s.camera.pixel[b.parent[k]];
      film.set_cache_features(pixel.x, pixel.y, answers[k].means(seconds));
    }
  }
}

}  // namespace dapple::distribution
