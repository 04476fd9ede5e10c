// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/feature_tracer.h"

#include <algorithm>
#include <cmath>

#include "dapple/base/parallel.h"
#include "dapple/integrate/camera_batch.h"
#include "dapple/integrate/feature_numbers.h"
#include "dapple/integrate/ray_origin.h"
#include "dapple/scattering/fresnel.h"
#include "dapple/scattering/sheet.h"

namespace dapple::integrate {

using scattering::Bsdf;
using scattering::BsdfKind;
using trace::no_id;

namespace {

using Numbers = FeatureNumbers;

bool is_smooth(const Bsdf& b) {
  return std::max(b.alpha_x, b.alpha_y) <= Numbers::smooth_alpha;
}

RGB no_brighter_than_white(const RGB& c) {
  return c * (1 / std::max(1.0f, c.max()));
}

}  // namespace

/// The rays of one camera sample of each pixel of a block, and what follows them.
struct FeatureTracer::Workspace {
  static constexpr int capacity = CameraBatch::capacity;

  struct PendingRay {
    int sample = 0;  ///< of the camera batch
    Ray ray;
    uint32_t key = 0;
    float width = 0, spread = 0;
    RGB weight{1};    ///< of the albedo found
    float share = 1;  ///< of the normal found
    int bounces = 0;
    int32_t medium = scene::vacuum;
  };
  struct Sum {
    double albedo[3] = {}, normal[3] = {}, weight = 0;
  };

  CameraBatch camera;
  StopToken stop;
  Sum sums[capacity];  ///< by pixel of the block
  std::vector<PendingRay> now, next;

  // A batch of `now`.
  const PendingRay* first = nullptr;
  trace::RayBatch rays;
  trace::HitBatch hits;
  RayTracer::Scratch tracing;
  int32_t medium[capacity];
  float distance[capacity];
  RGB passed[capacity];
  int points = 0, point_ray[capacity];
  uint32_t geometry[capacity];
  geom::SurfacePoint surface[capacity];
  Bsdf bsdf[capacity];
  MaterialTable::Scratch prelighting;
  StageCounts stages;

  void add(int sample, const RGB& albedo, const V3f& normal, float share) {
    Sum& s = sums[sample];
    const float w = camera.film_weight[sample];
    for (int c = 0; c < 3; ++c) {
      const float a = w * albedo[c], n = w * share * normal[c];
      if (std::isfinite(a)) s.albedo[c] += a;
      if (std::isfinite(n)) s.normal[c] += n;
    }
  }
};

FeatureTracer::Layers FeatureTracer::trace(const Box2i& pixels, StopToken stop) const {
  const int width = pixels.max.x - pixels.min.x, height = pixels.max.y - pixels.min.y;
  Layers layers;
  layers.albedo.resize(size_t(width) * size_t(height));
  layers.normal.resize(layers.albedo.size());
  std::vector<Box2i> blocks;
  CameraBatch::for_each_block(pixels, [&](const Box2i& block) { blocks.push_back(block); });
  parallel_for(blocks.size(), [&](size_t i) {
    const auto w = std::make_unique<Workspace>();
    w->stop = w->tracing.stop = stop;
    trace_block(blocks[i], *w);
    for (int p = 0; p < w->camera.count; ++p) {
      const Workspace::Sum& s = w->sums[p];
      if (!(s.weight > 0)) continue;
      const V2i pixel = w->camera.pixel[p] - pixels.min;
      const size_t at = size_t(pixel.y) * size_t(width) + size_t(pixel.x);
      const double inv = 1 / s.weight;
      layers.albedo[at] =
          clamp(RGB(float(s.albedo[0] * inv), float(s.albedo[1] * inv), float(s.albedo[2] * inv)), 0, 1);
      const V3f n(float(s.normal[0] * inv), float(s.normal[1] * inv), float(s.normal[2] * inv));
      layers.normal[at] = n * (1 / std::max(1.0f, length(n)));  // weights below 0, of some filters
    }
  });
  return layers;
}

void FeatureTracer::trace_block(const Box2i& block, Workspace& w) const {
  w.now.reserve(Workspace::capacity * Numbers::most_splits);
  w.next.reserve(Workspace::capacity * Numbers::most_splits);
  const PixelSets sets(settings_.pixel_samples, settings_.seed);
  for (int i = 0; i < settings_.samples; ++i) {
    w.camera.generate(scene_, block, uint32_t(i), sets);
    start_rays(w);
    while (!w.now.empty()) {
      follow_rays(w);
      std::swap(w.now, w.next);
      w.next.clear();
    }
  }
}

void FeatureTracer::start_rays(Workspace& w) const {
  const float footprint = std::max(0.125f, 1 / std::sqrt(float(settings_.samples)));
  w.now.clear();
  for (int p = 0; p < w.camera.count; ++p) {
    const scene::CameraRay& r = w.camera.ray[p];
    float& weight = w.camera.film_weight[p];
    weight = scene::joining_weight(weight, w.sums[p].weight);
    w.sums[p].weight += double(weight);
    Workspace::PendingRay ray;
    ray.sample = p;
    ray.ray = r.ray;
    ray.key = trace::ray_key(w.camera.seed[p], w.camera.index[p]);
    ray.width = r.cone_width * footprint, ray.spread = r.cone_spread * footprint;
    w.now.push_back(ray);
  }
}

void FeatureTracer::follow_rays(Workspace& w) const {
  for (size_t first = 0; first < w.now.size(); first += Workspace::capacity) {
    w.stop.check();
    w.first = &w.now[first];
    const int n = int(std::min(w.now.size() - first, size_t(Workspace::capacity)));
    for (int i = 0; i < n; ++i) {
      const Workspace::PendingRay& r = w.first[i];
      w.rays.set(i, r.ray.o, r.ray.d, infinity, r.ray.time, r.key, r.width, r.spread);
      w.medium[i] = r.medium;
    }
    tracer_.nearest(w.rays, n, w.medium, &w.hits, w.distance, w.passed, w.tracing);
    w.points = 0;
    for (int i = 0; i < n; ++i) {
      if (w.hits.geometry[i] == no_id) {
        add_sky(i, w);
        continue;
      }
      const int k = w.points++;
      w.point_ray[k] = i;
      w.geometry[k] = w.hits.geometry[i];
      w.surface[k] = scene_.traced.surface(w.hits, i, w.first[i].ray.time);
    }
    materials_.prelight(
        w.points, w.geometry, w.surface,
        [&](int k, pattern::ShadingPoints* out, int lane) {
          const int i = w.point_ray[k];
          const Workspace::PendingRay& r = w.first[i];
          scene::Scene::set_point(w.surface[k], r.ray.d, r.width + r.spread * w.distance[i], r.ray.time,
                                  hash(settings_.seed, r.key), out, lane);
        },
        w.bsdf, w.prelighting, &w.stages);
    for (int k = 0; k < w.points; ++k)
      if (!follow_specular(k, w)) describe(k, w);
  }
}

// Radiance as what stands for a colour between 0 and 1.
RGB FeatureTracer::displayed(const RGB& L) const {
  return L.is_finite() ? no_brighter_than_white(clamp(L, 0, infinity) * scene_.film.scale) : RGB(1);
}

void FeatureTracer::add_sky(int i, Workspace& w) const {
  const Workspace::PendingRay& r = w.first[i];
  RGB L;
  for (const uint32_t light : scene_.infinite_lights)
    L += scene_.lights[light]->environment_at(w.rays.origin(i), r.ray.d, 0);
  w.add(r.sample, r.weight * w.passed[i] * displayed(L), V3f(0, 0, 0), 0);
}

void FeatureTracer::describe(int k, Workspace& w) const {
  const int i = w.point_ray[k];
  const Workspace::PendingRay& r = w.first[i];
  const V3f wo = -r.ray.d;
  RGB albedo = w.bsdf[k].albedo();
  if (const emitters::Light* light = scene_.emitter(w.geometry[k], w.hits.primitive[i]))
    albedo += displayed(light->emitted(w.surface[k].P, w.surface[k].Ng, V2f(w.surface[k].u, w.surface[k].v), wo));
  w.add(r.sample, r.weight * w.passed[i] * no_brighter_than_white(albedo), w.bsdf[k].normal_towards(wo), r.share);
}

// Sends on what a mirror or clear glass shows. False where point k shows itself.
bool FeatureTracer::follow_specular(int k, Workspace& w) const {
  const int i = w.point_ray[k];
  const Workspace::PendingRay r = w.first[i];
  const Bsdf& b = w.bsdf[k];
  if (r.bounces >= Numbers::most_bounces || scene_.emitter(w.geometry[k], w.hits.primitive[i])) return false;
  const V3f wo = -r.ray.d, n = b.frame.n;
  const auto send = [&](const V3f& d, const RGB& weight) {
    Workspace::PendingRay next = r;
    next.ray.o = offset_origin(w.surface[k], d);
    next.ray.d = d;
    next.width = r.width + r.spread * w.distance[i];
    next.key = uint32_t(hash(uint64_t(r.key), dot(d, w.surface[k].Ng) > 0 ? 1u : 2u));
    next.weight = r.weight * w.passed[i] * weight;
    next.share = r.share * weight.average();
    next.bounces = r.bounces + 1;
    next.medium = scene_.bindings[w.geometry[k]].medium_beyond(d, w.surface[k].Ng, w.medium[i]);
    w.next.push_back(next);
  };
  const float cosine = dot(wo, n);
  // Bent normals can send a mirror image below the surface: then it shows itself.
  const V3f mirrored = scattering::reflect(wo, n);
  const bool mirrors = dot(mirrored, w.surface[k].Ng) * dot(wo, w.surface[k].Ng) > 0;
  if (b.kind == BsdfKind::conductor && is_smooth(b) && mirrors) {
    send(mirrored, scattering::fresnel_conductor(std::abs(cosine), b.eta, b.k));
    return true;
  }
  const bool pane = b.kind == BsdfKind::thin_dielectric;
  if (!pane && !(b.kind == BsdfKind::dielectric && is_smooth(b))) return false;
  V3f through = r.ray.d;
  float unused;
  const bool passes = pane || scattering::refract(wo, n, b.ior, &through, &unused);
  if (passes && dot(through, w.surface[k].Ng) * dot(wo, w.surface[k].Ng) > 0) return false;  // bent normals, again
  const float F = !passes ? 1
                  : pane  ? 1 - scattering::straight_transmittance(b, wo)
                          : fresnel_dielectric(cosine, b.ior);
  if (!passes && !mirrors) return false;
  // Of a share that no longer counts, the stronger way stands for both.
  const bool both =
      mirrors && passes && F * r.share >= Numbers::least_share && (1 - F) * r.share >= Numbers::least_share;
  if (both) {
    send(mirrored, RGB(F));
    send(through, RGB(1 - F));
  } else if (!passes || (mirrors && F > 0.5f)) {
    send(mirrored, RGB(1));
  } else {
    send(through, RGB(1));
  }
  return true;
}

}  // namespace dapple::integrate
