// SPDX-License-Identifier: Apache-2.0
#include "dapple/path/path_light.h"

#include <utility>

#include "dapple/emitters/learned_lights.h"
#include "dapple/integrate/ray_origin.h"
#include "dapple/numeric/warp.h"
#include "dapple/path/path_numbers.h"

namespace dapple::path {

using integrate::offset_origin;
using integrate::ShadowRay;
using scattering::Bsdf;
using scattering::BsdfKind;
using trace::no_id;

// What the medium of path p emitted along its ray; it may be a light that shadow rays look for, too.
void PathLight::add_glow(int p, const RGB& emitted, const V3f& o, const V3f& d, PathWorkspace& w) const {
  if (emitted.is_black()) return;
  const uint32_t light = scene_.glow_light(w.medium[p], o);
  const bool lit = light != no_id;
  float weight = 1;
  if (lit && w.bsdf_pdf[p] > 0) {
    const float pdf =
        flights_.light_probability(p, light, w) * scene_.lights[light]->pdf(w.receiver[p], d, o, V3f(0, 0, 0));
    weight = power_heuristic(w.bsdf_pdf[p], pdf);
  }
  w.add_light(p, no_id, w.beta[p] * emitted * weight, lit && w.finds_direct(p));
}

void PathLight::add_environment(int p, const V3f& o, const V3f& d, PathWorkspace& w) const {
  for (const uint32_t index : scene_.infinite_lights) {
    const emitters::Light& light = *scene_.lights[index];
    const RGB Le = light.environment_at(o, d, 0);  // unfiltered, as light samples are
    if (Le.is_black() || (w.shafted[p] && flights_.owns(index, d))) continue;
    float weight = 1;
    if (w.bsdf_pdf[p] > 0) {
      const emitters::Light& drawn = w.shafted[p] ? flights_.rest_of(index) : light;
      const float pdf = flights_.light_probability(p, index, w) *
                        emitters::light_pdf(drawn, int(index), w.receiver[p], d, V3f(0, 0, 0), V3f(0, 0, 0));
      weight = power_heuristic(w.bsdf_pdf[p], pdf);
    }
    w.add_light(p, index, w.beta[p] * Le * weight, w.finds_direct(p));
  }
}

void PathLight::add_emission(int p, uint32_t index, const geom::SurfacePoint& s, const V3f& d, PathWorkspace& w) const {
  const emitters::Light& light = *scene_.lights[index];
  const RGB Le = light.emitted(s.P, s.Ng, V2f(s.u, s.v), -d);
  if (Le.is_black()) return;
  float weight = 1;
  if (w.bsdf_pdf[p] > 0) {
    const float pdf = flights_.light_probability(p, index, w) * light.pdf(w.receiver[p], d, s.P, s.Ng);
    weight = power_heuristic(w.bsdf_pdf[p], pdf);
  }
  w.add_light(p, index, w.beta[p] * Le * weight, w.finds_direct(p));
}

// Draws a light for path p and sends a shadow ray. evaluate(wi, &pdf) gives f |cos|; `surface` is null in media.
template <class Evaluate>
void PathLight::connect(int k, const emitters::LightReceiver& receiver, const geom::SurfacePoint* surface,
                        const Evaluate& evaluate, PathWorkspace& w) const {
  const int p = w.point_path[k];
  // Planes have some lights; these are not drawn.
  const bool shafted = !surface && flights_.is_straight(p, w);
  const emitters::LightSampler* const sampler = shafted ? flights_.rest() : scene_.light_sampler.get();
  const auto selection =
      sampler ? sampler->select(receiver, w.sample(PathWorkspace::dim_light, k)) : emitters::LightSampler::Selection();
  if (selection.light < 0) return;
  const emitters::Light& drawn =
      shafted ? flights_.rest_of(uint32_t(selection.light)) : *scene_.lights[size_t(selection.light)];
  emitters::LightSample light;
  if (!emitters::sample_light(drawn, selection.light, receiver, w.sample2(PathWorkspace::dim_light_point, k), &light))
    return;
  float scatter_pdf = 0;
  const RGB f = evaluate(light.wi, &scatter_pdf);
  if (f.is_black()) return;
  const float light_pdf = light.pdf * selection.probability;
  const float weight = light.delta ? 1 : power_heuristic(light_pdf, scatter_pdf);
  const RGB contribution = w.beta[p] * f * (light.glow ? RGB(1) : light.radiance) * (weight / light_pdf);
  if (contribution.is_black()) return;
  if (shafted && flights_.owns(uint32_t(selection.light), light.wi)) return;
  const V3f origin = surface ? offset_origin(*surface, light.wi) : receiver.p;
  int32_t medium = w.medium[p];
  if (surface) medium = scene_.bindings[w.point_geometry[k]].medium_beyond(light.wi, surface->Ng, medium);
  const ShadowRay ray(receiver.p, light, origin);
  const V3f Ng = surface ? surface->Ng : V3f(0, 0, 0);
  if (ray.distance > 0)
    w.push_shadow(p, uint32_t(selection.light), origin, Ng, ray.d, ray.distance, contribution, medium);
}

void PathLight::set_receiver(int k, const emitters::LearnedLights* learned, PathWorkspace& w) {
  const Bsdf& bsdf = w.bsdf[k];
  const int p = w.point_path[k];
  emitters::LightReceiver& receiver = w.receiver[p];
  receiver.transmits = bsdf.has_transmission();
  receiver.p = w.surface[k].P;
  receiver.n = bsdf.normal_towards(-w.wi[k]);
  receiver.time = w.time[p];
  receiver.shared = true;
  receiver.region = learned ? learned->region(receiver, w.vertex_key(p, 0)) : emitters::LightRegion();
}

void PathLight::note_point(int k, PathWorkspace& w) const {
  if (w.walk[w.point_path[k]].inside()) return;
  const geom::SurfacePoint& s = w.surface[k];
  const int p = w.point_path[k];
  w.points_found->note({w.receiver[p], s.Ng, s.error, w.point_geometry[k], w.medium[p]});
}

void PathLight::light_surface(int k, PathWorkspace& w) const {
  const Bsdf& bsdf = w.bsdf[k];
  if (!scene_.light_sampler || bsdf.is_delta()) return;
  if (w.points_found) return note_point(k, w);
  // What shines inside a body is found by walking: light is weakened on the way, which shadow rays do not know.
  if (bsdf.kind != BsdfKind::subsurface && w.walk[w.point_path[k]].inside()) return;
  const V3f wo = -w.wi[k];
  const uint64_t key = w.vertex_key(w.point_path[k], 1);
  connect(
      k, w.receiver[w.point_path[k]], &w.surface[k],
      [&](const V3f& wi, float* pdf) {
        const RGB f = bsdf.eval_pdf(wo, wi, key, pdf);
        if (bsdf.kind == BsdfKind::subsurface && dot(wi, w.surface[k].Ng) < 0) return RGB();
        return f * std::abs(dot(wi, bsdf.frame.n));
      },
      w);
}

// Nothing that leaves a smooth boundary can meet a light without extent. Diffused light hardly changes within a few
// degrees, so such a light is taken to be as wide as that.
void PathLight::find_delta_light(int k, const V3f& wi, PathWorkspace& w) const {
  if (!scene_.light_sampler || w.points_found) return;
  const int p = w.point_path[k];
  const emitters::LightReceiver receiver{w.surface[k].P, w.bsdf[k].frame.n, w.time[p]};
  const auto selection = scene_.light_sampler->select(receiver, w.sample(PathWorkspace::dim_light, k));
  emitters::LightSample light;
  if (selection.light < 0 || !scene_.lights[size_t(selection.light)]->is_delta() ||
      !scene_.lights[size_t(selection.light)]->sample(receiver, w.sample2(PathWorkspace::dim_light_point, k), &light) ||
      dot(wi, light.wi) < PathNumbers::delta_cosine)
    return;
  const RGB L =
      w.beta[p] * light.radiance * (1 / (light.pdf * selection.probability * 2 * pi * (1 - PathNumbers::delta_cosine)));
  if (L.is_black() || !L.is_finite()) return;
  const V3f origin = offset_origin(w.surface[k], light.wi);
  const ShadowRay ray(receiver.p, light, origin);
  const V3f& Ng = w.surface[k].Ng;
  if (ray.distance > 0 && dot(light.wi, Ng) > 0)
    w.push_shadow(p, uint32_t(selection.light), origin, Ng, ray.d, ray.distance, L, w.medium[p]);
}

void PathLight::trace_shadows(PathWorkspace& w) const {
  const int masked = rays_.visible(w.shadow, w.shadow_normal, w.shadow_count, w.shadow_medium, w.shadow_glow,
                                   w.shadow_light, w.shadow_scratch);
  w.stages += std::exchange(w.shadow_scratch.stages, {});
  w.rays.mask += uint64_t(masked);
  w.rays.shadow += uint64_t(w.shadow_count - masked);
  for (int i = 0; i < w.shadow_count; ++i)
    if (!w.shadow_light[i].is_black())
      w.add_light(w.shadow_path[i], w.shadow_source[i], w.shadow_L[i] * w.shadow_light[i], w.shadow_direct[i]);
}

// At the end of a path; the light of those that are chosen counts `weight` times.
void PathLight::light_end(int k, float weight, PathWorkspace& w) const {
  if (w.points_found) return note_point(k, w);
  const Bsdf& bsdf = w.bsdf[k];
  const V3f wo = -w.wi[k];
  const uint64_t key = w.vertex_key(w.point_path[k], 1);
  emitters::LightReceiver receiver = w.receiver[w.point_path[k]];
  receiver.shared = false;
  connect(
      k, receiver, &w.surface[k],
      [&](const V3f& wi, float* pdf) {
        const RGB f = bsdf.eval_pdf(wo, wi, key, pdf);
        *pdf = 0;  // no ray goes on that could meet the light
        return f * (std::abs(dot(wi, bsdf.frame.n)) * weight);
      },
      w);
}

void PathLight::light_medium(int k, const emitters::LightReceiver& receiver, const media::HenyeyGreenstein& phase,
                             PathWorkspace& w) const {
  const int p = w.point_path[k];
  if (w.points_found) {
    // Of each path the first: in a dense cloud shadow rays take thousands of steps.
    if (w.scatterings[p] == 0) w.points_found->note({.to = receiver, .medium = w.medium[p]});
    return;
  }
  if (!scene_.light_sampler) return;
  const V3f wo = -w.wi[k];
  connect(
      k, receiver, nullptr, [&](const V3f& wi, float* pdf) { return RGB(*pdf = phase.eval(wo, wi)); }, w);
}

}  // namespace dapple::path
