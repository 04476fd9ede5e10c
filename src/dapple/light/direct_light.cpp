// SPDX-License-Identifier: Apache-2.0
#include "dapple/light/direct_light.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "dapple/integrate/ray_origin.h"
#include "dapple/light/shaft_light.h"
#include "dapple/media/medium.h"

namespace dapple::light {

using emitters::Light;
using integrate::LightSums;
using integrate::offset_origin;
using integrate::PointBatch;
using integrate::RayList;
using integrate::RayOrigin;
using integrate::RaySet;
using integrate::RayTracer;
using integrate::ShadowRay;
using scattering::Bsdf;
using trace::no_id;
using trace::RayBatch;

namespace {

constexpr uint32_t for_lights = 1;  // of all that random numbers of a point are for
float least_alpha(float spread, int diffuse_depth) {
  using N = DirectNumbers;
  return spread * (diffuse_depth >= 2
                       ? N::least_alpha
                       : std::clamp(N::most_alpha / N::few_spread * spread, N::least_alpha, N::most_alpha));
}
enum Target : uint8_t { to_irradiance, to_irradiance_behind, to_specular };

// Something lets a part of the light through: where rays are stopped by draws (RayTracer::visible through media), one
// says little about it.
bool has_veils(const scene::Scene& scene) {
  return std::any_of(scene.bindings.begin(), scene.bindings.end(), [](const scene::GeometryBinding& b) {
    const auto even = b.alpha ? b.alpha->constant() : std::optional(1.0f);
    return b.opacity || (even && *even > 0 && *even < 1);
  });
}

}  // namespace

DirectLight::DirectLight(const scene::Scene& scene, const RayTracer& tracer, const RayList& shadow_rays,
                         std::shared_ptr<const emitters::LearnedLights> learned)
    : scene_(scene), tracer_(tracer), shadow_rays_(shadow_rays), learned_(std::move(learned)) {
  const bool veiled = (tracer.draws_opacity() && has_veils(scene)) || tracer.draws_sheets();
  for (const auto& light : scene.lights) {
    one_ray_serves_.push_back(light->is_delta() && !veiled);
  }
  for (const auto& light : scene.lights) {
    throws_edges_ |= light->is_delta() || light->is_infinite();
    glints_ |= light->is_delta();
    has_sky_ |= light->is_infinite() && !light->is_delta();
  }
  group_ = scene.light_groups.of_light;
  group_.resize(scene.lights.size());
}

bool DirectLight::pays_to_learn(const scene::Scene& scene) {
  const auto is_sky = [](const auto& light) { return light->is_infinite() && !light->is_delta(); };
  return scene.lights.size() > 1 || scene.has_media() || std::any_of(scene.lights.begin(), scene.lights.end(), is_sky);
}

DirectLight::Share DirectLight::share_of(const PointBatch& b, int k, int diffuse_depth) const {
  const int rays = shadow_rays_.at(diffuse_depth, 1, b.effort[k]);
  if (b.share[k] == 1 && int(scene_.lights.size()) <= DirectNumbers::lights_apart) return {rays, false};
  // A camera sample, or what a ray met, is one of many points of a pixel: what matters is what these send together.
  if (b.share[k] > 1 && b.stands_for_cone(k)) return {RayList::part(rays, b.share[k]), true};
  return {chosen_rays(rays, b.share[k]), true};
}

emitters::LightReceiver DirectLight::receiver(const PointBatch& b, int k, const RayOrigin& from) const {
  const Bsdf& bsdf = b.bsdf[k];
  const V3f n = from.normal(bsdf.frame.n);
  return {from.P,
          bsdf.side(b.wo[k]) < 0 ? -n : n,
          from.time,
          bsdf.has_transmission(),
          bsdf.is_diffuse() && b.seekers[k] > 0,
          region(b, k)};
}

// The same for all rays of a point, wherever they start.
emitters::LightRegion DirectLight::region(const PointBatch& b, int k) const {
  if (!learned_) return {};
  const Bsdf& bsdf = b.bsdf[k];
  return learned_->region({b.surface[k].P, bsdf.normal_towards(b.wo[k]), b.time[k], bsdf.has_transmission()}, b.key[k]);
}

void DirectLight::add_environment(const V3f& o, const V3f& d, LightSums& L, int p) const {
  for (const uint32_t light : scene_.infinite_lights)
    L.add(p, scene_.lights[light]->environment_at(o, d, 0), group_[light]);
}

void DirectLight::add_emission(const trace::HitBatch& hits, int i, const geom::SurfacePoint& s, const V3f& d,
                               LightSums& L, int p) const {
  const uint32_t light = scene_.emitter_index(hits.geometry[i], hits.primitive[i]);
  if (light != no_id) L.add(p, scene_.lights[light]->emitted(s.P, s.Ng, V2f(s.u, s.v), -d), group_[light]);
}

void DirectLight::light(PointBatch& b, int diffuse_depth, const bool* wanted, LightWorkspace& w) const {
  if (!scene_.light_sampler) return;
  const int lights = int(scene_.lights.size());
  w.job_count = 0;
  const auto add = [&](int k, int light, int n) {
    const uint32_t seed = uint32_t(hash(b.sequence[k], for_lights, uint32_t(light)));
    for (int i = 0; i < n; ++i) {
      // Rays that draw() joins stand in one batch of jobs, whatever stood there before.
      if (i % w.capacity == 0 && w.job_count + std::min(n - i, w.capacity) > w.capacity) draw(b, diffuse_depth, w);
      w.job_point[w.job_count] = k;
      w.job_light[w.job_count] = light;
      w.job_weight[w.job_count] = 1 / float(n);
      w.seed[w.job_count] = seed;
      w.index[w.job_count++] = b.number[k] * uint32_t(n) + uint32_t(i);
    }
  };
  for (int k = 0; k < b.count; ++k) {
    if (!wanted[k]) continue;
    const auto [rays, chooses] = share_of(b, k, diffuse_depth);
    if (chooses) {
      add(k, -1, rays);
      continue;
    }
    for (int light = 0; light < lights; ++light) {
      // A light without size throws shadows with edges, but over cells and over time.
      const int n = !one_ray_serves_[size_t(light)] || b.duration[k] > 0 ? rays : std::clamp(b.origins[k], 1, rays);
      add(k, light, n);
    }
  }
  if (w.job_count > 0) draw(b, diffuse_depth, w);
}

// The shadow ray of a job towards what was drawn for it. False if it could not bring anything.
bool DirectLight::add_shadow_ray(const PointBatch& b, int diffuse_depth, int job, const RayOrigin& from,
                                 LightWorkspace& w) const {
  const int k = w.job_point[job];
  const emitters::LightSampler::Selection& chosen = w.chosen[job];
  const emitters::LightSample& light = *w.drawn_for[job];
  const Bsdf& bsdf = b.bsdf[k];
  const V3f normal = from.normal(bsdf.frame.n);
  const float cosine = dot(light.wi, normal), pdf = light.pdf * chosen.probability;
  const bool glows = scene_.is_glow(uint32_t(chosen.light));
  RGB L = (glows ? RGB(1) : light.radiance) * (w.job_weight[job] * std::abs(cosine) / pdf);
  float glint = 0;
  Target target = to_specular;
  if (bsdf.is_diffuse()) {
    // Where the normal is bent, light comes from the side on which it is for both normals.
    target = cosine * bsdf.side(b.wo[k]) > 0 ? to_irradiance : to_irradiance_behind;
    if (bsdf.bent) L *= scattering::terminator(light.wi, normal, dot(normal, from.Ng) < 0 ? -from.Ng : from.Ng);
    L *= bsdf.crossing(cosine);
    if ((target == to_irradiance ? bsdf.reflectance : bsdf.transmittance).is_black()) return false;
    if (b.seekers[k] > 0 && !light.delta) {
      const float front = bsdf.reflected_share(), of_side = target == to_irradiance ? front : 1 - front;
      L *= power_heuristic(pdf / w.job_weight[job], std::abs(cosine) * inv_pi * of_side * float(b.seekers[k]));
    }
  } else {
    const uint64_t key = hash(b.key[k], w.seed[job], w.index[job]);
    if (light.delta) {
      const auto blurred = [&](float alpha) {
        Bsdf rough = bsdf;
        const float scale = rough.roughen(alpha);
        return L * scale * rough.eval(b.wo[k], light.wi, key);
      };
      const float spread = b.spread[k];
      if (spread > 0) glint = blurred(DirectNumbers::glint_alpha * spread).luminance();
      L = blurred(least_alpha(spread, diffuse_depth));
    } else {
      float bsdf_pdf = 0;
      L *= bsdf.eval_pdf(b.wo[k], light.wi, key, &bsdf_pdf);
      L *= power_heuristic(pdf / w.job_weight[job], bsdf_pdf * float(w.counts[k]));
    }
  }
  if (L.is_black() || !L.is_finite()) return false;
  const V3f origin = offset_origin(from, light.wi);
  const ShadowRay ray(from.P, light, origin);
  if (!(ray.distance > 0)) return false;
  const int s = w.shadow_count++;
  w.shadow.set(s, origin, ray.d, ray.distance, from.time, trace::ray_key(w.seed[job], w.index[job]), b.width[k],
               b.spread[k]);
  w.shadow_medium[s] = scene_.bindings[b.geometry[k]].medium_beyond(light.wi, from.Ng, b.medium_of(k, from));
  w.shadow_normal[s] = from.Ng;
  w.shadow_point[s] = k;
  w.shadow_target[s] = target;
  w.shadow_light[s] = L;
  w.shadow_glint[s] = glint;
  w.shadow_source[s] = chosen.light;
  w.shadow_glow[s] = glows ? uint32_t(chosen.light) : no_id;
  return true;
}

// Draws points on lights for jobs that start from the same place at the same time, and may reorder them.
void DirectLight::draw_from_one_place(const PointBatch& b, std::span<int> jobs, LightWorkspace& w) const {
  const int first = jobs[0], k = w.job_point[first];
  const RayOrigin from = b.origin_of(k, int(w.index[first]), w.seed[first]);
  const emitters::LightReceiver to = receiver(b, k, from);
  const auto light_of = [&w](int job) { return w.chosen[job].light; };
  if (w.job_light[first] < 0) {
    float u[LightWorkspace::capacity];
    emitters::LightSampler::Selection chosen[LightWorkspace::capacity];
    for (size_t i = 0; i < jobs.size(); ++i) u[i] = w.u2[jobs[i]];
    scene_.light_sampler->select(to, {u, jobs.size()}, chosen);
    for (size_t i = 0; i < jobs.size(); ++i) w.chosen[jobs[i]] = chosen[i];
    std::sort(jobs.begin(), jobs.end(), [&](int i, int j) { return light_of(i) < light_of(j); });
  } else {
    for (const int job : jobs) w.chosen[job] = {w.job_light[job], 1};
  }
  for (size_t begin = 0, end = 0; begin < jobs.size(); begin = end) {
    const int light = light_of(jobs[begin]);
    V2f u[Light::most_at_once];
    for (; end < jobs.size() && end < begin + Light::most_at_once && light_of(jobs[end]) == light; ++end)
      u[end - begin] = {w.u0[jobs[end]], w.u1[jobs[end]]};
    emitters::LightSample* const drawn = w.drawn + w.drawn_count;
    w.drawn_count += int(end - begin);
    const uint32_t found =
        light < 0 ? 0 : emitters::sample_light(*scene_.lights[size_t(light)], light, to, {u, end - begin}, drawn);
    for (size_t i = begin; i < end; ++i)
      w.drawn_for[jobs[i]] = found >> (i - begin) & 1 ? drawn + (i - begin) : nullptr;
  }
}

// Draws points on lights for jobs [begin, end), all of one point.
void DirectLight::draw_lights(const PointBatch& b, int begin, int end, LightWorkspace& w) const {
  const int k = w.job_point[begin];
  int jobs[LightWorkspace::capacity];
  std::iota(jobs, jobs + (end - begin), begin);
  const std::span all(jobs, size_t(end - begin));
  if (b.has_one_origin(k)) return draw_from_one_place(b, all, w);
  if (b.duration[k] > 0) {
    for (size_t i = 0; i < all.size(); ++i) draw_from_one_place(b, all.subspan(i, 1), w);
    return;
  }
  const auto origin = [&](int job) { return b.origin_index(k, int(w.index[job])); };
  // Those towards one light stay together.
  std::sort(all.begin(), all.end(),
            [&](int i, int j) { return origin(i) != origin(j) ? origin(i) < origin(j) : i < j; });
  for (size_t i = 0, next = 0; i < all.size(); i = next) {
    while (next < all.size() && origin(all[next]) == origin(all[i])) ++next;
    draw_from_one_place(b, all.subspan(i, next - i), w);
  }
}

// Draws a point on a light for each job, and traces the shadow rays.
void DirectLight::draw(PointBatch& b, int diffuse_depth, LightWorkspace& w) const {
  w.draw_samples(w.job_count);
  w.shadow_count = w.drawn_count = 0;
  for (int begin = 0, end = 0; begin < w.job_count; begin = end) {
    const int k = w.job_point[begin];
    while (end < w.job_count && w.job_point[end] == k) ++end;
    draw_lights(b, begin, end, w);
    // In the order of the jobs: sums must not depend on who had the same place or light.
    for (int first = begin, last = begin; first < end; first = last) {
      while (last < end && w.job_light[last] == w.job_light[first]) ++last;
      add_shadow_rays(b, diffuse_depth, first, last, w);
    }
  }
  trace(w);
  LightSums* const sums[] = {&b.irradiance, &b.irradiance_behind, &b.specular};
  for (int s = 0; s < w.shadow_count; ++s) {
    if (w.visible[s].is_black()) continue;
    const RGB L = w.shadow_light[s] * w.visible[s];
    const size_t source = size_t(w.shadow_source[s]);
    sums[w.shadow_target[s]]->add(w.shadow_point[s], L, group_[source]);
    if (w.shadow_glint[s] > 0) b.glint[w.shadow_point[s]] += w.shadow_glint[s] * w.visible[s].luminance();
  }
  w.job_count = 0;
}

// Rays of a run of jobs of one point and light.
void DirectLight::add_shadow_rays(PointBatch& b, int diffuse_depth, int first, int last, LightWorkspace& w) const {
  const int k = w.job_point[first];
  RayOrigin from = b.origin_of(k, int(w.index[first]), w.seed[first]);
  const bool joins = w.job_light[first] >= 0 && RayBatch::pays_to_join(last - first);
  for (int j = first, in_packet = 0; j < last; ++j) {
    if ((j - first) % RayBatch::packet == 0) in_packet = 0;
    if (!w.drawn_for[j]) continue;
    if (!b.has_one_origin(k)) from = b.origin_of(k, int(w.index[j]), w.seed[j]);
    if (add_shadow_ray(b, diffuse_depth, j, from, w)) w.shadow.joined[w.shadow_count - 1] = joins && in_packet++ > 0;
  }
}

void DirectLight::trace(LightWorkspace& w) const {
  const Timer timer;
  const int masked =
      tracer_.visible(w.shadow, w.shadow_normal, w.shadow_count, w.shadow_medium, w.shadow_glow, w.visible, w.tracing);
  w.stages.tracing_seconds += timer.seconds();
  w.stages += std::exchange(w.tracing.stages, {});
  w.rays.mask += uint64_t(masked);
  w.rays.shadow += uint64_t(w.shadow_count - masked);
}

// Density, a steradian and in expected rays, of shadow rays that find wi on this light.
float DirectLight::density(const emitters::LightReceiver& to, uint32_t index, const V3f& wi,
                           const geom::SurfacePoint& s, const Share& share) const {
  const float pdf = emitters::light_pdf(*scene_.lights[index], int(index), to, wi, s.P, s.Ng) * float(share.rays);
  return share.chooses && pdf > 0 ? pdf * scene_.light_sampler->probability(to, int(index)) : pdf;
}

void DirectLight::add_lights_hit(const PointBatch& b, RaySet& r, int diffuse_depth) const {
  for (int i = 0; i < r.count; ++i) {
    const int k = r.point[i];
    r.L.clear(i);
    if (r.pdf[i] < 0) continue;
    const V3f d = r.rays.direction(i);
    const auto add = [&](uint32_t light, const RGB& Le, const geom::SurfacePoint& s) {
      if (Le.is_black()) return;
      float weight = 1;
      if (r.pdf[i] > 0) {
        const emitters::LightReceiver to = receiver(b, k, b.origin_of(r, i));
        weight = power_heuristic(r.pdf[i], density(to, light, d, s, share_of(b, k, diffuse_depth)));
      }
      r.L.add(i, Le * weight, group_[light]);
    };
    if (r.hits.geometry[i] == no_id) {
      if (r.distance[i] < infinity) continue;  // it scattered in a medium
      for (const uint32_t light : scene_.infinite_lights)
        add(light, scene_.lights[light]->environment_at(r.rays.origin(i), d, 0), {});
      continue;
    }
    const uint32_t light = scene_.emitter_index(r.hits.geometry[i], r.hits.primitive[i]);
    if (light == no_id) continue;
    const geom::SurfacePoint s = scene_.traced.surface(r.hits, i, r.rays.time[i]);
    add(light, scene_.lights[light]->emitted(s.P, s.Ng, V2f(s.u, s.v), -d), s);
  }
  for (const RayTracer::Flights::Lit& lit : r.lit) {
    const int i = lit.ray, k = r.point[i];
    if (r.pdf[i] < 0) continue;
    float weight = 1;
    if (r.pdf[i] > 0)
      weight = power_heuristic(r.pdf[i], density(receiver(b, k, b.origin_of(r, i)), lit.light, r.rays.direction(i), {},
                                                 share_of(b, k, diffuse_depth)));
    r.glow[i] += lit.radiance * weight;
  }
}

void DirectLight::light_media(PointBatch& b, int diffuse_depth, const ShaftLight* but, LightWorkspace& w) const {
  const emitters::LightSampler* const sampler = but ? but->rest() : scene_.light_sampler.get();
  if (!sampler) return;
  int rays[PointBatch::capacity], most = 0;
  for (int k = 0; k < b.count; ++k) {
    rays[k] = chosen_rays(shadow_rays_.at(diffuse_depth), b.share[k]);
    most = std::max(most, rays[k]);
  }
  for (int i = 0; i < most; ++i) {
    for (int k = 0; k < b.count; ++k) {
      w.seed[k] = uint32_t(hash(b.key[k], for_lights));
      w.index[k] = uint32_t(i);
    }
    w.draw_samples(b.count);
    w.shadow_count = 0;
    for (int k = 0; k < b.count; ++k) {
      if (i >= rays[k]) continue;
      const V3f& P = b.surface[k].P;
      emitters::LightReceiver to{P, V3f(0, 0, 0), b.time[k]};
      if (learned_ && !but) to.region = learned_->region(to, b.key[k]);
      const auto chosen = sampler->select(to, w.u2[k]);
      if (chosen.light < 0) continue;
      const emitters::Light& of = but ? but->rest_of(uint32_t(chosen.light)) : *scene_.lights[size_t(chosen.light)];
      emitters::LightSample light;
      if (!emitters::sample_light(of, chosen.light, to, V2f(w.u0[k], w.u1[k]), &light)) continue;
      if (but && but->owns(uint32_t(chosen.light), light.wi)) continue;
      const float phase = scene_.media[size_t(b.medium[k])]->phase().eval(b.wo[k], light.wi);
      const RGB L =
          (light.glow ? RGB(1) : light.radiance) * (phase / (light.pdf * chosen.probability * float(rays[k])));
      const ShadowRay ray(to.p, light, P);
      if (L.is_black() || !L.is_finite() || !(ray.distance > 0)) continue;
      const int s = w.shadow_count++;
      w.shadow.set(s, P, ray.d, ray.distance, b.time[k], trace::ray_key(w.seed[k], w.index[k]), b.width[k],
                   b.spread[k]);
      w.shadow_medium[s] = b.medium[k];
      w.shadow_normal[s] = V3f(0, 0, 0);
      w.shadow_point[s] = k;
      w.shadow_light[s] = L;
      w.shadow_source[s] = chosen.light;
      w.shadow_glow[s] = light.glow ? uint32_t(chosen.light) : no_id;
    }
    trace(w);
    for (int s = 0; s < w.shadow_count; ++s)
      if (!w.visible[s].is_black())
        b.Ci.add(w.shadow_point[s], w.shadow_light[s] * w.visible[s], group_[size_t(w.shadow_source[s])]);
  }
}

}  // namespace dapple::light
