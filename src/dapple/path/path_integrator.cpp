// SPDX-License-Identifier: Apache-2.0
#include "dapple/path/path_integrator.h"

#include <algorithm>
#include <utility>

#include "dapple/integrate/describe.h"
#include "dapple/integrate/ray_origin.h"
#include "dapple/media/medium.h"
#include "dapple/numeric/sobol.h"
#include "dapple/numeric/warp.h"
#include "dapple/path/path_numbers.h"
#include "dapple/path/path_samples.h"
#include "dapple/path/path_workspace.h"
#include "dapple/path/spread_paths.h"
#include "dapple/scattering/sheet.h"
#include "dapple/shading/stages.h"
#include "dapple/vegetation/mask_scene.h"

namespace dapple::path {

using integrate::CacheState;
using integrate::CameraBatch;
using integrate::describe;
using integrate::offset_origin;
using integrate::TileWork;
using scattering::Bsdf;
using scattering::BsdfKind;
using scattering::BsdfSample;
using scattering::Lobe;
using scene::Film;
using trace::no_id;
using vegetation::CanopyTransport;
using vegetation::mask_cache;

namespace {

// Dimensions of so many steps are for what camera rays meet; then come scatterings of straight flights.
constexpr uint32_t steps_of_surfaces = 1 << 14;

// Of a path, whatever the step.
constexpr uint32_t for_channels = (1u << 20) + 1, for_wavelengths = for_channels + 1;

// Surfaces without scattering between media do not count as scatterings; this ends a path caught between them.
constexpr int max_passes = 4096;

// Of all that random numbers are for.
constexpr uint64_t for_learning = 0x6c69676874, for_leaves = 0x6c6561766573;

}  // namespace

PathIntegrator::PathIntegrator(const scene::Scene& scene, const Settings& settings)
    : scene_(scene),
      settings_(settings),
      materials_(scene),
      rays_(scene, materials_, true, settings.visibility()),
      flights_(scene, settings.shafts, settings.texture_footprint),
      light_(scene, rays_, flights_),
      ends_(settings.radiosity, 1 / settings.texture_footprint),
      learned_(settings.learned_lights) {
  hit_lights_ =
      gathers() || std::any_of(scene.lights.begin(), scene.lights.end(), [](const auto& l) { return !l->is_delta(); });
  if (settings.learning_paths > 0 && light::pays_to_learn(scene)) learn();
}

void PathIntegrator::learn() {
  light_points_ = settings_.light_points ? settings_.light_points
                                         : std::make_shared<const std::vector<light::LightPoint>>(find_light_points());
  learned_ = light::learn_lights(scene_, rays_, *light_points_, hash(settings_.seed, for_learning), settings_.stop);
}

std::vector<light::LightPoint> PathIntegrator::find_light_points() const {
  LearningPoints points(spread_batches(settings_.learning_paths));
  const uint64_t seed = hash(settings_.seed, for_learning);
  follow_spread_paths(scene_, ends_, points.batches(), seed, settings_.stop, [&](size_t i, PathWorkspace& w) {
    w.points_found = points.of_batch(i);
    trace_camera_rays(w);
  });
  return points.thinned();
}

PathIntegrator::SeenLeaves PathIntegrator::look_at_leaves(int paths, const std::vector<uint8_t>& is_leaf,
                                                          StopToken stop) const {
  std::vector<LeafNotes> of_batch(spread_batches(paths), LeafNotes(is_leaf));
  const uint64_t seed = hash(settings_.seed, for_leaves);
  follow_spread_paths(scene_, ends_, of_batch.size(), seed, stop, [&](size_t i, PathWorkspace& w) {
    w.leaf_notes = &of_batch[i];
    w.leaf_notes->start(w.camera.count);
    trace_camera_rays(w);
    w.leaf_notes->finish(w.L);
  });
  SeenLeaves seen;
  seen.paths = int(of_batch.size()) * PathWorkspace::capacity;
  for (const LeafNotes& n : of_batch) {
    seen.notes.insert(seen.notes.end(), n.notes.begin(), n.notes.end());
    seen.light += n.light;
  }
  return seen;
}

std::unique_ptr<integrate::Integrator::Workspace> PathIntegrator::make_workspace() const {
  auto w = std::make_unique<PathWorkspace>();
  w->caches.resize(caches().size());
  ends_.prepare(*w);
  return w;
}

std::vector<CacheState> PathIntegrator::caches() const {
  std::vector<CacheState> states = ends_.caches();
  if (settings_.masks) states.push_back(mask_cache(*settings_.masks));
  return states;
}

void PathIntegrator::prepare(const Film::Settings& film, const StopToken& stop, PathWorkspace& w) const {
  w.shadow_scratch.stop = stop;
  w.wants_features = film.features;
  w.wants_air = film.air;
  w.keep_groups(scene_.light_groups, film.light_groups);
}

void PathIntegrator::render(const TileWork& work, Workspace& workspace, Film& film) const {
  auto& w = static_cast<PathWorkspace&>(workspace);
  prepare(film.settings(), work.stop, w);
  const PixelSets sets(work.pixel_samples, settings_.seed);
  for (uint32_t i = 0; i < work.sample_count; ++i)
    CameraBatch::for_each_block(work.pixels, [&](const Box2i& box) {
      w.camera.generate(scene_, box, work.first_sample + i, sets);
      trace_camera_rays(w);
      for (int p = 0; p < w.path_count; ++p)
        film.add(w.camera.pixel[p].x, w.camera.pixel[p].y, w.camera.film_weight[p], w.L[p], w.features[p], w.parts(p),
                 w.direct[p]);
      for (int p = 0; p < w.path_count && w.wants_air; ++p)
        film.add_air(w.camera.pixel[p].x, w.camera.pixel[p].y, w.camera.film_weight[p], w.air[p]);
    });
  ends_.collect_counts(w);
}

void PathIntegrator::trace(const std::vector<uint8_t>& others, const Film::Settings& film, const StopToken& stop,
                           integrate::PathSamples& s, Workspace& workspace) const {
  auto& w = static_cast<PathWorkspace&>(workspace);
  prepare(film, stop, w);
  w.camera = s.camera;
  start_paths(w);
  scene_.traced.intersect(w.now->batch, w.now->count, &w.hit);
  leave_to_others(others, s, w);
  take_step(0, w);
  trace_paths(1, w);
  if (flights_) trace_straight_flights(w);
  write_samples(w, s);
  ends_.collect_counts(w);
}

void PathIntegrator::start_paths(PathWorkspace& w) const {
  w.path_count = w.camera.count;
  w.first_glow = scene_.glow.first_light();
  for (int p = 0; p < w.path_count; ++p) {
    const scene::CameraRay& r = w.camera.ray[p];
    w.start_path(p);
    w.cone_width[p] = r.cone_width * settings_.texture_footprint;
    w.cone_spread[p] = r.cone_spread * settings_.texture_footprint;
    w.time[p] = r.ray.time;
    w.medium[p] = scene_.camera_medium;
    w.receiver[p] = {r.ray.o, V3f(0, 0, 0), r.ray.time};
    if ((w.beta[p] *= r.weight).max() > 0) w.push_ray(p, r.ray.o, r.ray.d, w.next_key(p));
  }
  w.swap_rays();
  w.rays.camera += uint64_t(w.path_count);
}

void PathIntegrator::trace_paths(uint32_t first_step, PathWorkspace& w) const {
  for (uint32_t step = first_step; w.now->count > 0; ++step) {
    w.shadow_scratch.stop.check();
    scene_.traced.intersect(w.now->batch, w.now->count, &w.hit);
    take_step(step, w);
  }
  w.now->count = 0;
}

void PathIntegrator::trace_straight_flights(PathWorkspace& w) const {
  if (w.leaf_notes) w.leaf_notes->close(w.L);
  flights_.restart(w);
  if (w.flight_count == 0) return;
  const bool wanted_features = std::exchange(w.wants_features, false);  // these are of what camera rays met
  shade_points(steps_of_surfaces, w);
  trace_paths(steps_of_surfaces + 1, w);
  w.wants_features = wanted_features;
}

void PathIntegrator::trace_from_hits(const trace::HitBatch& hits, PathWorkspace& w) const {
  start_paths(w);
  for (int i = 0; i < w.now->count; ++i) w.hit.copy_lane(i, hits, i);
  take_step(0, w);
  trace_paths(1, w);
}

void PathIntegrator::take_step(uint32_t step, PathWorkspace& w) const {
  if (scene_.traced.has_colored_opacity())
    for (int i = 0; i < w.now->count; ++i) w.beta[w.now->path[i]] *= w.hit.weight(i);
  ends_.end_rays(w);
  collect_hits(w);
  prelight(w);
  shade_points(step, w);
}

// The surfaces of a step, and its scatterings in media: light, and where paths go on.
void PathIntegrator::shade_points(uint32_t step, PathWorkspace& w) const {
  w.append_flights();
  w.draw_samples(CameraBatch::dimensions + step * PathWorkspace::dimensions);
  w.shadow_count = 0;
  for (int k = 0; k < w.surface_count; ++k) {
    if (w.bsdf[k].kind == BsdfKind::passthrough) {
      pass_through(k, w);
      continue;
    }
    if (materials_.is_sheet(w.point_geometry[k]) && pass_sheet(k, w)) continue;
    const int p = w.point_path[k];
    if (w.coat_alone[k]) w.bsdf[k].keep_coat(-w.wi[k]);
    if (w.leaf_notes) note_leaf(k, w);
    if (w.last[p] && !gathers()) continue;
    PathLight::set_receiver(k, learned_.get(), w);
    if (w.last[p]) {
      end_in_canopy(k, *settings_.canopy, w);
      continue;
    }
    if (settings_.leaf_answers && may_end_in_leaf(k, w) &&
        settings_.leaf_answers->is_leaf(w.point_geometry[k], w.surface[k].P)) {
      end_in_canopy(k, *settings_.leaf_answers, w);
      continue;
    }
    if (w.bsdf[k].dispersion > 0) disperse(k, w);
    light_.light_surface(k, w);
    if (settings_.canopy && !settings_.canopy_gather && w.diffuse_depth[p] >= settings_.diffuse_bounces)
      add_canopy_light(k, *settings_.canopy, w);
    scatter(k, w);
  }
  for (int k = w.surface_count; k < w.point_count; ++k) scatter_in_medium(k, w);
  w.swap_rays();
  light_.trace_shadows(w);
}

// Adds what rays meet that shines, and gathers the surfaces to be shaded.
void PathIntegrator::collect_hits(PathWorkspace& w) const {
  w.point_count = w.flight_count = 0;
  if (scene_.has_media()) fly(w);
  for (int i = 0; i < w.now->count; ++i) {
    const int p = w.now->path[i];
    const V3f d = w.now->batch.direction(i);
    if (w.walk[p].inside() ? !walk(i, w) : w.medium[p] != scene::vacuum && !arrive(i, w)) continue;
    if (w.hit.geometry[i] == no_id) {
      light_.add_environment(p, w.now->batch.origin(i), d, w);
      continue;
    }
    const uint32_t light = scene_.emitter_index(w.hit.geometry[i], w.hit.primitive[i]);
    if (w.last[p] && light == no_id && !gathers() && !materials_.lets_through(w.hit.geometry[i])) continue;
    if (w.left[i] == PathWorkspace::Left::nothing && light == no_id) continue;
    const int k = w.point_count++;
    w.point_path[k] = p;
    w.point_geometry[k] = w.hit.geometry[i];
    w.wi[k] = d;
    w.surface[k] = light != no_id || materials_.needs_tangents(w.hit.geometry[i])
                       ? scene_.traced.surface(w.hit, i, w.time[p])
                       : scene_.traced.surface_without_tangents(w.now->batch, w.hit, i);
    w.cone_width[p] += w.cone_spread[p] * w.hit.t[i];
    if (light != no_id) light_.add_emission(p, light, w.surface[k], d, w);
    w.coat_alone[k] = w.left[i] == PathWorkspace::Left::coat;
    if (w.left[i] == PathWorkspace::Left::nothing) --w.point_count;
  }
}

// Draws how far the rays go through their media.
void PathIntegrator::fly(PathWorkspace& w) const {
  const trace::RayBatch& rays = w.now->batch;
  const auto add = [&](int i, media::MediumRays* out) {
    const int p = w.now->path[i];
    const Ray ray{rays.origin(i), rays.direction(i), infinity, w.time[p]};
    out->add(ray, w.hit.geometry[i] == no_id ? infinity : w.hit.t[i], w.beta[p], w.vertex_key(p, 0));
  };
  const auto medium = [&](int i) {
    const int p = w.now->path[i];
    return w.walk[p].inside() || flights_.is_straight(p, w) ? scene::vacuum : w.medium[p];
  };
  w.shadow_scratch.media.sample(scene_, w.now->count, medium, add, w.flown);
}

// Takes the path of ray i through its medium to what the ray hit. False if it does not arrive.
bool PathIntegrator::arrive(int i, PathWorkspace& w) const {
  const int p = w.now->path[i];
  if (flights_.is_straight(p, w)) return flights_.arrive(i, w);
  const trace::RayBatch& rays = w.now->batch;
  const media::MediumSample& s = w.flown[i];
  light_.add_glow(p, s.emitted, rays.origin(i), rays.direction(i), w);
  w.beta[p] *= s.weight;
  if (w.beta[p].is_black() || !w.beta[p].is_finite()) return false;
  if (!s.scattered) return true;
  if (!w.last[p]) w.flight[w.flight_count++] = {p, rays.origin(i) + rays.direction(i) * s.t, rays.direction(i)};
  return false;
}

// The same inside a subsurface body. Where the path scatters, it goes on in the following step.
bool PathIntegrator::walk(int i, PathWorkspace& w) const {
  const int p = w.now->path[i];
  if (w.hit.geometry[i] == no_id) {  // the body has no other side
    w.walk[p].start();
    return true;
  }
  const Ray ray{w.now->batch.origin(i), w.now->batch.direction(i), infinity, w.time[p]};
  V3f P, d;
  const auto flight = w.walk[p].fly(ray, w.hit.t[i], w.eta_scale[p], w.vertex_key(p, 2), &w.beta[p], &P, &d);
  if (flight != SubsurfaceWalk::Flight::scattered) return flight == SubsurfaceWalk::Flight::arrived;
  w.bsdf_pdf[p] = 0;
  w.push_ray(p, P, d, w.next_key(p));
  ++w.rays.subsurface;
  return false;
}

void PathIntegrator::prelight(PathWorkspace& w) const {
  int kept = 0;
  for (int k = 0; k < w.point_count; ++k)
    if (!w.last[w.point_path[k]] || gathers() || materials_.lets_through(w.point_geometry[k])) w.move_point(kept++, k);
  w.point_count = w.surface_count = kept;
  materials_.prelight(
      kept, w.point_geometry, w.surface,
      [&w](int k, pattern::ShadingPoints* points, int lane) {
        const int p = w.point_path[k];
        scene::Scene::set_point(w.surface[k], w.wi[k], w.cone_width[p], w.time[p], w.vertex_key(p, 1), points, lane);
      },
      w.bsdf, w.prelighting, &w.stages);
  if (w.wants_features) describe_first_surfaces(w);
}

void PathIntegrator::describe_first_surfaces(PathWorkspace& w) const {
  for (int k = 0; k < w.point_count; ++k) {
    const int p = w.point_path[k];
    if (w.bsdf[k].kind == BsdfKind::passthrough || w.features[p].alpha > 0) continue;
    w.features[p] = describe(scene_, w.surface[k]);
  }
}

void PathIntegrator::pass_through(int k, PathWorkspace& w) const {
  const int p = w.point_path[k];
  if (++w.passes[p] > max_passes) return;
  w.medium[p] = scene_.bindings[w.point_geometry[k]].medium_beyond(w.wi[k], w.surface[k].Ng, w.medium[p]);
  w.push_ray(p, offset_origin(w.surface[k], w.wi[k]), w.wi[k], w.next_key(p));
}

// Straight through a clear sheet, as if it were not there, so that the path keeps the density and the receiver of its
// last scattering: shadow rays have gone the same way. False if it is scattered here.
bool PathIntegrator::pass_sheet(int k, PathWorkspace& w) const {
  const float through = scattering::straight_transmittance(w.bsdf[k], -w.wi[k]);
  if (through == 0) return false;
  if (w.sample(PathWorkspace::dim_lobe, k) < 1 - through) {
    w.bsdf[k].reflects_only = true;
    return false;
  }
  pass_through(k, w);
  ++w.rays.specular;
  return true;
}

// Light that the canopy's leaves scattered, at a diffuse surface; what has other lobes besides counts by its albedo.
void PathIntegrator::add_canopy_light(int k, const CanopyTransport& canopy, PathWorkspace& w) const {
  const Bsdf& bsdf = w.bsdf[k];
  if (bsdf.is_delta()) return;
  const int p = w.point_path[k];
  const CanopyTransport::Sides E = canopy.scattered(w.point_geometry[k], w.surface[k].P, bsdf.normal_towards(-w.wi[k]));
  w.add_light(p, no_id,
              w.beta[p] * (bsdf.is_diffuse() ? shading::lambertian_radiance(bsdf, E.front, E.behind)
                                             : bsdf.albedo() * E.front * inv_pi),
              false);
}

// Where a path ends: the canopy's light, and at some of these points, the brighter the more, that of one light.
void PathIntegrator::end_in_canopy(int k, const CanopyTransport& canopy, PathWorkspace& w) const {
  const Bsdf& bsdf = w.bsdf[k];
  add_canopy_light(k, canopy, w);
  const float share = std::clamp((w.beta[w.point_path[k]] * bsdf.albedo()).max(), PathNumbers::lit_share, 1.0f);
  if (!scene_.light_sampler || bsdf.is_delta() || w.sample(PathWorkspace::dim_roulette, k) >= share) return;
  light_.light_end(k, 1 / share, w);
}

// Diffuse leaves alone: shadow rays light the ends of paths, and do not find what a coat mirrors.
bool PathIntegrator::may_end_in_leaf(int k, const PathWorkspace& w) {
  const int p = w.point_path[k];
  return !w.last[p] && w.diffuse_depth[p] > 0 && !w.walk[p].inside() && w.bsdf[k].is_diffuse();
}

void PathIntegrator::note_leaf(int k, PathWorkspace& w) const {
  const int p = w.point_path[k];
  w.leaf_notes->arrive(p, w.L[p]);
  if (!may_end_in_leaf(k, w) || !w.leaf_notes->wants(p, w.point_geometry[k])) return;
  const Bsdf& bsdf = w.bsdf[k];
  w.leaf_notes->note(p, {.geometry = w.point_geometry[k],
                         .P = w.surface[k].P,
                         .n = bsdf.normal_towards(-w.wi[k]),
                         .front = w.beta[p] * bsdf.reflectance * inv_pi,
                         .behind = w.beta[p] * bsdf.transmittance * inv_pi,
                         .scattered = RGB()});
}

void PathIntegrator::scatter_in_medium(int k, PathWorkspace& w) const {
  const int p = w.point_path[k];
  if (w.leaf_notes) w.leaf_notes->arrive(p, w.L[p]);
  const media::HenyeyGreenstein& phase = scene_.media[size_t(w.medium[p])]->phase();
  emitters::LightReceiver receiver{.p = w.surface[k].P, .time = w.time[p], .shared = true};
  const bool straight = flights_.is_straight(p, w);
  if (learned_ && !straight) receiver.region = learned_->region(receiver, w.vertex_key(p, 0));
  light_.light_medium(k, receiver, phase, w);
  V3f wi;
  const float pdf = phase.sample(-w.wi[k], w.sample2(PathWorkspace::dim_direction, k), &wi);
  if (!end_or_go_on(k, Lobe::glossy, w)) return;
  w.shafted[p] = straight;
  w.bsdf_pdf[p] = pdf;
  w.receiver[p] = receiver;
  ends_.note_ray(p, false, w);
  w.push_ray(p, receiver.p, wi, w.next_key(p));
  ++w.rays.specular;
}

// Counts a scattering of path p at point k, and says whether the path goes on. Russian roulette changes its throughput.
bool PathIntegrator::end_or_go_on(int k, Lobe lobe, PathWorkspace& w) const {
  const int p = w.point_path[k];
  const bool diffuse = lobe == Lobe::diffuse;
  ++w.scatterings[p];
  w.shafted[p] = 0;
  w.after_diffuse[p] = w.diffuse_depth[p] > 0;
  const int depth = diffuse ? ++w.diffuse_depth[p] : ++w.specular_depth[p];
  w.last[p] = depth > (diffuse ? settings_.diffuse_bounces : settings_.specular_depth) ||
              w.scatterings[p] >= settings_.max_scatterings;
  if (w.last[p]) return hit_lights_;
  if (w.scatterings[p] < settings_.roulette_depth) return true;
  const float survive = std::min(1.0f, (w.beta[p] * w.eta_scale[p]).max());
  if (w.sample(PathWorkspace::dim_roulette, k) >= survive) return false;
  w.beta[p] *= 1 / survive;
  return true;
}

// The path goes on with one channel, chosen by what it would carry, and at a wavelength that stays: at further surfaces
// that disperse light there is but this channel left.
void PathIntegrator::disperse(int k, PathWorkspace& w) const {
  const int p = w.point_path[k];
  const RGB beta = w.beta[p];
  const float sum = beta.r + beta.g + beta.b;
  const float u = sum * sample_1d(w.camera.seed[p], w.camera.index[p], for_channels);
  const int channel = u < beta.r ? 0 : u < beta.r + beta.g || beta.b <= 0 ? (beta.g > 0 ? 1 : 0) : 2;
  w.beta[p] = RGB();
  w.beta[p][channel] = sum;
  w.bsdf[k].disperse(
      scattering::wavelength_of(channel, sample_1d(w.camera.seed[p], w.camera.index[p], for_wavelengths)));
}

void PathIntegrator::scatter(int k, PathWorkspace& w) const {
  const Bsdf& bsdf = w.bsdf[k];
  const int p = w.point_path[k];
  BsdfSample sample;
  const uint64_t key = w.vertex_key(p, 3);
  if (!bsdf.sample(-w.wi[k], w.sample(PathWorkspace::dim_lobe, k), w.sample2(PathWorkspace::dim_direction, k), key,
                   &sample))
    return;
  w.beta[p] *= sample.weight;
  if (sample.transmitted) w.eta_scale[p] *= sqr(sample.eta);
  if (w.beta[p].is_black() || !w.beta[p].is_finite()) return;
  if (bsdf.kind == BsdfKind::subsurface) return cross_boundary(k, sample, w);
  if (!end_or_go_on(k, sample.lobe, w)) return;
  w.bsdf_pdf[p] = w.walk[p].inside() ? 0 : sample.pdf;
  const bool diffuse = sample.lobe == Lobe::diffuse;
  ends_.note_ray(p, diffuse && !w.last[p] && !w.walk[p].inside() && w.medium[p] == scene::vacuum, w);
  if (diffuse) w.cone_spread[p] = std::max(w.cone_spread[p], PathNumbers::diffuse_spread);
  // Also where it was reflected, as for shadow rays: the side says so, if the surface knows, whatever the medium was in
  // which the path came.
  w.medium[p] = scene_.bindings[w.point_geometry[k]].medium_beyond(sample.wi, w.surface[k].Ng, w.medium[p]);
  w.push_ray(p, offset_origin(w.surface[k], sample.wi), sample.wi, w.next_key(p));
  ++(diffuse ? w.rays.diffuse : w.rays.specular);
}

// Into a subsurface body, out of it, or back from its boundary on either side. The way through counts as one diffuse
// scattering; where nothing scattered it, as a specular one.
void PathIntegrator::cross_boundary(int k, const BsdfSample& sample, PathWorkspace& w) const {
  const int p = w.point_path[k];
  const geom::SurfacePoint& s = w.surface[k];
  SubsurfaceWalk& walk = w.walk[p];
  const bool was_inside = walk.inside(), inwards = dot(sample.wi, s.Ng) < 0;
  const bool diffused = was_inside && walk.scattered();
  const bool smooth = w.bsdf[k].is_delta();
  walk.cross(w.bsdf[k], inwards);
  ends_.note_ray(p, false, w);
  if (inwards) {
    if (walk.is_clear() && !end_or_go_on(k, sample.lobe, w)) return;
    w.bsdf_pdf[p] = 0;
    ++w.rays.subsurface;
  } else {
    if (diffused && smooth) light_.find_delta_light(k, sample.wi, w);
    if (!end_or_go_on(k, diffused ? Lobe::diffuse : sample.lobe, w)) return;
    w.bsdf_pdf[p] = sample.pdf;
    if (diffused) w.cone_spread[p] = std::max(w.cone_spread[p], PathNumbers::diffuse_spread);
    ++(diffused ? w.rays.diffuse : w.rays.specular);
  }
  w.push_ray(p, offset_origin(s, sample.wi), sample.wi, w.next_key(p));
}

}  // namespace dapple::path
