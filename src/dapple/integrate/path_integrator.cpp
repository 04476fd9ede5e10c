// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/path_integrator.h"

#include <algorithm>

#include "dapple/integrate/path_workspace.h"
#include "dapple/numeric/sobol.h"
#include "dapple/numeric/warp.h"
#include "dapple/shading/medium.h"

namespace dapple::integrate {

using scene::Features;
using scene::Film;
using shading::Bsdf;
using shading::BsdfKind;
using shading::BsdfSample;
using shading::Lobe;
using trace::no_id;

namespace {

// Dimensions of the sampler: the camera's first, then a block of them for every step of the paths.
enum CameraDimension : uint32_t { dim_filter, dim_lens, dim_time, camera_dimensions };
enum StepDimension : uint32_t { dim_light_point, dim_direction, dim_light, dim_lobe, dim_roulette, step_dimensions };
static_assert(step_dimensions == PathWorkspace::dimensions);

// Surfaces without scattering between media, and cut-outs, do not count as scatterings; this ends a path caught between them.
constexpr int max_steps = 4096;

// Texture footprints after a diffuse scattering: wide enough to use filtered texels, narrow enough not to blur light and texture together.
constexpr float diffuse_spread = 0.05f;

V3f offset_origin(const geom::SurfacePoint& s, const V3f& direction) {
  return s.P + s.Ng * (dot(direction, s.Ng) < 0 ? -s.error : s.error);
}

}  // namespace

PathIntegrator::PathIntegrator(const scene::Scene& scene, const Settings& settings)
    : scene_(scene), settings_(settings) {
  for (const shading::MaterialPtr& material : scene.materials) {
    constants_.push_back(material->constant());
    const auto& c = constants_.back();
    needs_tangents_.push_back(!c || c->alpha_x != c->alpha_y || c->base_alpha_x != c->base_alpha_y);
  }
  for (uint32_t g = 0; g < scene.bindings.size(); ++g) shadows_pass_ |= passes(g);
  shadows_pass_ |= scene.has_media();
  hit_lights_ = std::any_of(scene.lights.begin(), scene.lights.end(), [](const auto& l) { return !l->is_delta(); });
}

std::unique_ptr<Integrator::Workspace> PathIntegrator::make_workspace() const {
  return std::make_unique<PathWorkspace>();
}

void PathIntegrator::render(const TileWork& work, Workspace& workspace, Film& film) const {
  auto& w = static_cast<PathWorkspace&>(workspace);
  w.wants_features = film.settings().features;
  for (uint32_t i = 0; i < work.sample_count; ++i)
    for (int y = work.pixels.min.y; y < work.pixels.max.y; y += block)
      for (int x = work.pixels.min.x; x < work.pixels.max.x; x += block) {
        const Box2i box(V2i(x, y), V2i(std::min(x + block, work.pixels.max.x), std::min(y + block, work.pixels.max.y)));
        generate(box, work.first_sample + i, w);
        trace_paths(w);
        for (int p = 0; p < w.path_count; ++p)
          film.add(w.pixel[p].x, w.pixel[p].y, w.film_weight[p], w.L[p], w.features[p]);
      }
}

void PathIntegrator::generate(const Box2i& box, uint32_t sample, PathWorkspace& w) const {
  int n = 0;
  for (int y = box.min.y; y < box.max.y; ++y)
    for (int x = box.min.x; x < box.max.x; ++x, ++n) {
      w.pixel[n] = V2i(x, y);
      w.seed[n] = pixel_seed(x, y, settings_.seed);
      w.index[n] = sample;
    }
  w.path_count = n;
  sample_2d(w.seed, w.index, dim_filter, n, w.u0, w.u1);
  sample_2d(w.seed, w.index, dim_lens, n, w.u2, w.u3);
  sample_1d(w.seed, w.index, dim_time, n, w.u4);
  for (int p = 0; p < n; ++p) {
    const scene::Filter::Sample f = scene_.filter.sample(V2f(w.u0[p], w.u1[p]));
    const V2f film(float(w.pixel[p].x) + 0.5f + f.offset.x, float(w.pixel[p].y) + 0.5f + f.offset.y);
    const scene::CameraRay r = scene_.camera.generate(film, V2f(w.u2[p], w.u3[p]), w.u4[p]);
    w.film_weight[p] = f.weight;
    w.start_path(p);
    w.cone_width[p] = r.cone_width * settings_.texture_footprint;
    w.cone_spread[p] = r.cone_spread * settings_.texture_footprint;
    w.time[p] = r.ray.time;
    w.medium[p] = scene_.camera_medium;
    w.receiver[p] = {r.ray.o, V3f(0, 0, 0), r.ray.time};
    w.push_ray(p, r.ray.o, r.ray.d, w.next_key(p));
  }
  w.swap_rays();
  w.rays.camera += uint64_t(n);
}

void PathIntegrator::trace_paths(PathWorkspace& w) const {
  for (int step = 0; w.now->count > 0 && step < max_steps; ++step) {
    scene_.traced.intersect(w.now->batch, w.now->count, &w.hit);
    collect_hits(w);
    prelight(w);
    w.append_flights();
    w.draw_samples(camera_dimensions + uint32_t(step) * step_dimensions);
    w.shadow_count = 0;
    for (int k = 0; k < w.surface_count; ++k) {
      if (w.bsdf[k].kind == BsdfKind::passthrough) {
        pass_through(k, w);
        continue;
      }
      light_surface(k, w);
      scatter(k, w);
    }
    for (int k = w.surface_count; k < w.point_count; ++k) scatter_in_medium(k, w);
    w.swap_rays();
    if (shadows_pass_)
      trace_shadows_through(w);
    else
      trace_shadows(w);
  }
  w.now->count = 0;
}

bool PathIntegrator::passes(uint32_t geometry) const {
  const auto& constant = constants_[size_t(scene_.bindings[geometry].material)];
  return constant && constant->kind == BsdfKind::passthrough;
}

// Adds what rays meet that shines, and gathers the surfaces to be shaded.
void PathIntegrator::collect_hits(PathWorkspace& w) const {
  w.point_count = w.flight_count = 0;
  for (int i = 0; i < w.now->count; ++i) {
    const int p = w.now->path[i];
    const V3f d = w.now->batch.direction(i);
    if (w.medium[p] != scene::vacuum && !fly(i, w)) continue;
    if (w.hit.geometry[i] == no_id) {
      add_environment(p, d, w);
      continue;
    }
    const scene::GeometryBinding& binding = scene_.bindings[w.hit.geometry[i]];
    const uint32_t light = scene_.emitter_index(w.hit.geometry[i], w.hit.primitive[i]);
    if (w.last[p] && light == no_id && !passes(w.hit.geometry[i])) continue;
    const int k = w.point_count++;
    w.point_path[k] = p;
    w.point_geometry[k] = w.hit.geometry[i];
    w.wi[k] = d;
    w.surface[k] = light != no_id || needs_tangents_[size_t(binding.material)]
                       ? scene_.traced.surface(w.hit, i, w.time[p])
                       : scene_.traced.surface_without_tangents(w.now->batch, w.hit, i);
    w.cone_width[p] += w.cone_spread[p] * w.hit.t[i];
    if (light != no_id) add_emission(p, light, w.surface[k], d, w);
  }
}

// Takes the path of ray i through its medium to what the ray hit. False if it does not arrive.
bool PathIntegrator::fly(int i, PathWorkspace& w) const {
  const int p = w.now->path[i];
  const trace::RayBatch& rays = w.now->batch;
  const Ray ray{rays.origin(i), rays.direction(i), infinity, w.time[p]};
  const float t_max = w.hit.geometry[i] == no_id ? infinity : w.hit.t[i];
  const shading::MediumSample s = scene_.media[size_t(w.medium[p])]->sample(ray, t_max, w.beta[p], w.vertex_key(p, 0));
  w.L[p] += w.beta[p] * s.emitted;
  w.beta[p] *= s.weight;
  if (w.beta[p].is_black() || !w.beta[p].is_finite()) return false;
  if (!s.scattered) return true;
  if (!w.last[p]) w.flight[w.flight_count++] = {p, ray.o + ray.d * s.t, ray.d};
  return false;
}

void PathIntegrator::add_environment(int p, const V3f& d, PathWorkspace& w) const {
  for (const uint32_t index : scene_.infinite_lights) {
    const shading::Light& light = *scene_.lights[index];
    const RGB Le = light.environment(d, 0);  // unfiltered, as light samples are
    if (Le.is_black()) continue;
    float weight = 1;
    if (w.bsdf_pdf[p] > 0) {
      const float pdf = scene_.light_sampler->probability(w.receiver[p], int(index)) *
                        light.pdf(w.receiver[p], d, V3f(0, 0, 0), V3f(0, 0, 0));
      weight = power_heuristic(w.bsdf_pdf[p], pdf);
    }
    w.L[p] += w.beta[p] * Le * weight;
  }
}

void PathIntegrator::add_emission(int p, uint32_t index, const geom::SurfacePoint& s, const V3f& d,
                                  PathWorkspace& w) const {
  const shading::Light& light = *scene_.lights[index];
  const RGB Le = light.emitted(s.P, s.Ng, V2f(s.u, s.v), -d);
  if (Le.is_black()) return;
  float weight = 1;
  if (w.bsdf_pdf[p] > 0) {
    const float pdf = scene_.light_sampler->probability(w.receiver[p], int(index)) *
                      light.pdf(w.receiver[p], d, s.P, s.Ng);
    weight = power_heuristic(w.bsdf_pdf[p], pdf);
  }
  w.L[p] += w.beta[p] * Le * weight;
}

// Evaluates materials, those with textures in batches of equal material.
void PathIntegrator::prelight(PathWorkspace& w) const {
  int kept = 0, batched = 0;
  for (int k = 0; k < w.point_count; ++k) {
    const int p = w.point_path[k];
    const int32_t material = scene_.bindings[w.point_geometry[k]].material;
    const auto& constant = constants_[size_t(material)];
    if (w.last[p] && !passes(w.point_geometry[k])) continue;
    w.move_point(kept, k);
    if (constant) {
      Bsdf& b = w.bsdf[kept];
      b = *constant;
      const geom::SurfacePoint& s = w.surface[kept];
      b.frame = needs_tangents_[size_t(material)] ? Frame(s.Ns, s.dPdu) : Frame(s.Ns);
    } else {
      w.batched[batched++] = {material, kept};
    }
    ++kept;
  }
  w.point_count = kept;
  w.surface_count = kept;
  w.shading_points += uint64_t(kept);
  std::stable_sort(w.batched, w.batched + batched, [](const auto& a, const auto& b) { return a.material < b.material; });
  for (int first = 0; first < batched;) {
    const int32_t material = w.batched[first].material;
    int n = 0;
    for (; first + n < batched && w.batched[first + n].material == material; ++n) {
      const int k = w.batched[first + n].point, p = w.point_path[k];
      const uint64_t key = w.vertex_key(p, 1);
      scene::Scene::set_point(w.surface[k], w.wi[k], w.cone_width[p], w.time[p], key, &w.points, n);
    }
    w.points.count = n;
    scene_.materials[size_t(material)]->prelighting(w.points, w.batch_bsdf);
    for (int i = 0; i < n; ++i) w.bsdf[w.batched[first + i].point] = w.batch_bsdf[i];
    first += n;
  }
  if (w.wants_features) describe_first_surfaces(w);
}

void PathIntegrator::describe_first_surfaces(PathWorkspace& w) const {
  for (int k = 0; k < w.point_count; ++k) {
    const int p = w.point_path[k];
    if (w.bsdf[k].kind == BsdfKind::passthrough || w.features[p].alpha > 0) continue;
    Features& f = w.features[p];
    f.alpha = 1;
    f.albedo = w.bsdf[k].albedo();
    f.normal = face_forward(w.bsdf[k].frame.n, -w.wi[k]);
    f.position = w.surface[k].P;
    f.depth = scene_.camera.world_to_camera().point(f.position).z;
  }
}

void PathIntegrator::pass_through(int k, PathWorkspace& w) const {
  const int p = w.point_path[k];
  const scene::GeometryBinding& binding = scene_.bindings[w.point_geometry[k]];
  if (binding.changes_medium)
    w.medium[p] = dot(w.wi[k], w.surface[k].Ng) < 0 ? binding.inside_medium : binding.outside_medium;
  w.push_ray(p, offset_origin(w.surface[k], w.wi[k]), w.wi[k], w.next_key(p));
}

// Draws a light for path p and sends a shadow ray. evaluate(wi, &pdf) gives f |cos|; `surface` is null in media.
template <class Evaluate>
void PathIntegrator::connect(int k, const shading::LightReceiver& receiver, const geom::SurfacePoint* surface,
                             const Evaluate& evaluate, PathWorkspace& w) const {
  const int p = w.point_path[k];
  const auto selection = scene_.light_sampler->select(receiver, w.sample(dim_light, k));
  if (selection.light < 0) return;
  shading::LightSample light;
  if (!scene_.lights[size_t(selection.light)]->sample(receiver, w.sample2(dim_light_point, k), &light)) return;
  float scatter_pdf = 0;
  const RGB f = evaluate(light.wi, &scatter_pdf);
  if (f.is_black()) return;
  const float light_pdf = light.pdf * selection.probability;
  const float weight = light.delta ? 1 : power_heuristic(light_pdf, scatter_pdf);
  const RGB contribution = w.beta[p] * f * light.radiance * (weight / light_pdf);
  if (contribution.is_black()) return;
  const V3f origin = surface ? offset_origin(*surface, light.wi) : receiver.p;
  int32_t medium = w.medium[p];
  if (surface) {
    const scene::GeometryBinding& binding = scene_.bindings[w.point_geometry[k]];
    if (binding.changes_medium)
      medium = dot(light.wi, surface->Ng) < 0 ? binding.inside_medium : binding.outside_medium;
  }
  if (std::isinf(light.distance)) {
    w.push_shadow(p, origin, light.wi, infinity, contribution, medium);
    return;
  }
  // Aimed anew from the origin that was moved, and short of the light by a little, so that it does not shadow itself.
  const V3f to_light = receiver.p + light.wi * light.distance - origin;
  const float distance = length(to_light);
  if (distance > 0)
    w.push_shadow(p, origin, to_light * (1 / distance), distance * (1 - 1e-4f), contribution, medium);
}

void PathIntegrator::light_surface(int k, PathWorkspace& w) const {
  const Bsdf& bsdf = w.bsdf[k];
  if (!scene_.light_sampler || bsdf.is_delta()) return;
  const V3f wo = -w.wi[k];
  const uint64_t key = w.vertex_key(w.point_path[k], 1);
  connect(k, receiver_at(k, w), &w.surface[k], [&](const V3f& wi, float* pdf) {
    const RGB f = bsdf.eval_pdf(wo, wi, key, pdf);
    return f * std::abs(dot(wi, bsdf.frame.n));
  }, w);
}

void PathIntegrator::scatter_in_medium(int k, PathWorkspace& w) const {
  const int p = w.point_path[k];
  const shading::HenyeyGreenstein& phase = scene_.media[size_t(w.medium[p])]->phase();
  const V3f wo = -w.wi[k];
  const shading::LightReceiver receiver{w.surface[k].P, V3f(0, 0, 0), w.time[p]};
  if (scene_.light_sampler)
    connect(k, receiver, nullptr, [&](const V3f& wi, float* pdf) { return RGB(*pdf = phase.eval(wo, wi)); }, w);
  V3f wi;
  const float pdf = phase.sample(wo, w.sample2(dim_direction, k), &wi);
  if (!end_or_go_on(k, Lobe::glossy, w)) return;
  w.bsdf_pdf[p] = pdf;
  w.receiver[p] = receiver;
  w.push_ray(p, receiver.p, wi, w.next_key(p));
  ++w.rays.specular;
}

shading::LightReceiver PathIntegrator::receiver_at(int k, const PathWorkspace& w) const {
  const Bsdf& bsdf = w.bsdf[k];
  const int p = w.point_path[k];
  return {w.surface[k].P, face_forward(bsdf.frame.n, -w.wi[k]), w.time[p], bsdf.has_transmission()};
}

// Counts a scattering of path p at point k, and says whether the path goes on. Russian roulette changes its throughput.
bool PathIntegrator::end_or_go_on(int k, Lobe lobe, PathWorkspace& w) const {
  const int p = w.point_path[k];
  const bool diffuse = lobe == Lobe::diffuse;
  ++w.scatterings[p];
  const int depth = diffuse ? ++w.diffuse_depth[p] : ++w.specular_depth[p];
  w.last[p] = depth > (diffuse ? settings_.diffuse_bounces : settings_.specular_depth) ||
              w.scatterings[p] >= settings_.max_scatterings;
  if (w.last[p]) return hit_lights_;
  if (w.scatterings[p] < settings_.roulette_depth) return true;
  const float survive = std::min(1.0f, (w.beta[p] * w.eta_scale[p]).max());
  if (w.sample(dim_roulette, k) >= survive) return false;
  w.beta[p] *= 1 / survive;
  return true;
}

void PathIntegrator::scatter(int k, PathWorkspace& w) const {
  const Bsdf& bsdf = w.bsdf[k];
  const int p = w.point_path[k];
  BsdfSample sample;
  const uint64_t key = w.vertex_key(p, 3);
  if (!bsdf.sample(-w.wi[k], w.sample(dim_lobe, k), w.sample2(dim_direction, k), key, &sample)) return;
  w.beta[p] *= sample.weight;
  if (sample.transmitted) w.eta_scale[p] *= sqr(sample.eta);
  if (w.beta[p].is_black() || !w.beta[p].is_finite()) return;
  if (!end_or_go_on(k, sample.lobe, w)) return;
  w.bsdf_pdf[p] = sample.pdf;
  w.receiver[p] = receiver_at(k, w);
  const bool diffuse = sample.lobe == Lobe::diffuse;
  if (diffuse) w.cone_spread[p] = std::max(w.cone_spread[p], diffuse_spread);
  const scene::GeometryBinding& binding = scene_.bindings[w.point_geometry[k]];
  if (sample.transmitted && binding.changes_medium)
    w.medium[p] = dot(sample.wi, w.surface[k].Ng) < 0 ? binding.inside_medium : binding.outside_medium;
  w.push_ray(p, offset_origin(w.surface[k], sample.wi), sample.wi, w.next_key(p));
  ++(diffuse ? w.rays.diffuse : w.rays.specular);
}

void PathIntegrator::trace_shadows(PathWorkspace& w) const {
  scene_.traced.occluded(w.shadow, w.shadow_count, w.occluded);
  w.rays.shadow += uint64_t(w.shadow_count);
  for (int i = 0; i < w.shadow_count; ++i)
    if (!w.occluded[i]) w.L[w.shadow_path[i]] += w.shadow_L[i];
}

// Shadow rays where surfaces may only separate media: from surface to surface, through those.
void PathIntegrator::trace_shadows_through(PathWorkspace& w) const {
  w.rays.shadow += uint64_t(w.shadow_count);
  for (int segment = 0; w.shadow_count > 0 && segment < max_steps; ++segment) {
    scene_.traced.intersect(w.shadow, w.shadow_count, &w.hit);
    int kept = 0;
    for (int i = 0; i < w.shadow_count; ++i) {
      const int p = w.shadow_path[i];
      const bool hit = w.hit.geometry[i] != no_id;
      if (hit && !passes(w.hit.geometry[i])) continue;
      const V3f d = w.shadow.direction(i);
      const float t = hit ? w.hit.t[i] : w.shadow.t_max[i];
      if (w.shadow_medium[i] != scene::vacuum) {
        const Ray ray{w.shadow.origin(i), d, infinity, w.time[p]};
        w.next_key(p);
        w.shadow_L[i] *= scene_.media[size_t(w.shadow_medium[i])]->transmittance(ray, t, w.vertex_key(p, 2));
      }
      if (!hit) {
        w.L[p] += w.shadow_L[i];
        continue;
      }
      const geom::SurfacePoint s = scene_.traced.surface_without_tangents(w.shadow, w.hit, i);
      const scene::GeometryBinding& binding = scene_.bindings[w.hit.geometry[i]];
      const int32_t medium = !binding.changes_medium     ? w.shadow_medium[i]
                             : dot(d, s.Ng) < 0 ? binding.inside_medium
                                                : binding.outside_medium;
      w.shadow.set(kept, offset_origin(s, d), d, w.shadow.t_max[i] - t, w.time[p], w.next_key(p));
      w.shadow_L[kept] = w.shadow_L[i];
      w.shadow_path[kept] = p;
      w.shadow_medium[kept++] = medium;
    }
    w.shadow_count = kept;
  }
}

}  // namespace dapple::integrate
