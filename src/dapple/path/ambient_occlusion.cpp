// SPDX-License-Identifier: Apache-2.0
#include "dapple/path/ambient_occlusion.h"

#include "dapple/integrate/camera_batch.h"
#include "dapple/integrate/describe.h"
#include "dapple/integrate/ray_origin.h"
#include "dapple/numeric/sobol.h"
#include "dapple/path/path_numbers.h"

namespace dapple::path {

using integrate::CameraBatch;
using integrate::describe;
using integrate::Integrator;
using integrate::MaterialTable;
using integrate::offset_origin;
using integrate::RayTracer;
using integrate::TileWork;
using trace::no_id;

struct AmbientOcclusion::OcclusionWorkspace final : Integrator::Workspace {
  static constexpr int capacity = CameraBatch::capacity;

  // The visible points, then what a batch of hemisphere rays met.
  struct Points {
    int count = 0;
    int owner[capacity];  ///< camera sample, or visible point
    uint32_t geometry[capacity];
    geom::SurfacePoint surface[capacity];
    V3f d[capacity];       ///< of the ray that arrived
    RGB passed[capacity];  ///< of the light on its way
    float width[capacity];
    scattering::Bsdf bsdf[capacity];
  } seen, met;

  CameraBatch camera;
  MaterialTable::Scratch prelighting;
  RayTracer::Scratch tracing;
  trace::RayBatch batch;
  trace::HitBatch hits;
  float distance[capacity];
  int32_t medium[capacity];
  RGB passed[capacity];
  RGB open[capacity];  ///< sum over the rays of a visible point
  int ray_owner[capacity];
  alignas(64) uint32_t sobol_seed[capacity], sobol_index[capacity];
  alignas(64) float u[capacity], v[capacity];
  int ray_count = 0;

  void prelight(const MaterialTable& materials, Points& points, float time_of(const OcclusionWorkspace&, int)) {
    materials.prelight(
        points.count, points.geometry, points.surface,
        [&](int k, pattern::ShadingPoints* out, int lane) {
          scene::Scene::set_point(points.surface[k], points.d[k], points.width[k], time_of(*this, points.owner[k]), 0,
                                  out, lane);
        },
        points.bsdf, prelighting, &stages);
  }
};

std::unique_ptr<Integrator::Workspace> AmbientOcclusion::make_workspace() const {
  return std::make_unique<OcclusionWorkspace>();
}

void AmbientOcclusion::render(const TileWork& work, Workspace& workspace, scene::Film& film) const {
  auto& w = static_cast<OcclusionWorkspace&>(workspace);
  w.tracing.stop = work.stop;
  const bool wants_features = film.settings().features;
  const PixelSets sets(work.pixel_samples, settings_.seed);
  CameraBatch::for_each_block(work.pixels, [&](const Box2i& box) {
    for (uint32_t i = 0; i < work.sample_count; ++i) {
      w.camera.generate(scene_, box, work.first_sample + i, sets);
      trace_camera_rays(w);
      trace_hemispheres(w);
      RGB L[OcclusionWorkspace::capacity];
      scene::Features features[OcclusionWorkspace::capacity];
      for (int k = 0; k < w.seen.count; ++k) {
        const int p = w.seen.owner[k];
        L[p] = w.open[k] * w.seen.passed[k] * (w.camera.ray[p].weight / float(settings_.rays));
        if (settings_.color_bleeding) L[p] *= w.seen.bsdf[k].albedo();
        if (wants_features) features[p] = describe(scene_, w.seen.surface[k]);
      }
      for (int p = 0; p < w.camera.count; ++p)
        film.add(w.camera.pixel[p].x, w.camera.pixel[p].y, w.camera.film_weight[p], L[p], features[p]);
    }
  });
}

void AmbientOcclusion::trace_camera_rays(OcclusionWorkspace& w) const {
  const CameraBatch& c = w.camera;
  for (int p = 0; p < c.count; ++p) {
    w.batch.set(p, c.ray[p].ray.o, c.ray[p].ray.d, infinity, c.ray[p].ray.time, trace::ray_key(c.seed[p], c.index[p]),
                c.ray[p].cone_width * PathNumbers::camera_share, c.ray[p].cone_spread * PathNumbers::camera_share);
    w.medium[p] = scene::vacuum;
  }
  tracer_.nearest(w.batch, c.count, w.medium, &w.hits, w.distance, w.passed, w.tracing);
  w.rays.camera += uint64_t(c.count);
  auto& seen = w.seen;
  seen.count = 0;
  for (int p = 0; p < c.count; ++p) {
    if (w.hits.geometry[p] == no_id) continue;
    const int k = seen.count++;
    seen.owner[k] = p;
    seen.geometry[k] = w.hits.geometry[p];
    seen.surface[k] = scene_.traced.surface(w.hits, p, c.ray[p].ray.time);
    seen.d[k] = w.batch.direction(p);
    seen.passed[k] = w.passed[p];
    seen.width[k] = c.ray[p].cone_width + c.ray[p].cone_spread * w.distance[p];
    w.open[k] = RGB();
  }
  w.prelight(materials_, seen, [](const OcclusionWorkspace& ws, int p) { return ws.camera.ray[p].ray.time; });
}

void AmbientOcclusion::trace_hemispheres(OcclusionWorkspace& w) const {
  w.ray_count = 0;
  for (int k = 0; k < w.seen.count; ++k)
    for (int i = 0; i < settings_.rays; ++i) {
      const int p = w.seen.owner[k];
      w.ray_owner[w.ray_count] = k;
      w.sobol_seed[w.ray_count] = w.camera.seed[p];
      w.sobol_index[w.ray_count] = w.camera.index[p] * uint32_t(settings_.rays) + uint32_t(i);
      if (++w.ray_count == OcclusionWorkspace::capacity) gather(w);
    }
  if (w.ray_count > 0) gather(w);
}

void AmbientOcclusion::gather(OcclusionWorkspace& w) const {
  sample_2d(w.sobol_seed, w.sobol_index, CameraBatch::dimensions, w.ray_count, w.u, w.v);
  const float spread = std::sqrt(pi / float(settings_.rays)) * PathNumbers::occlusion_share;
  for (int i = 0; i < w.ray_count; ++i) {
    const int k = w.ray_owner[i];
    Frame frame = w.seen.bsdf[k].frame;
    if (w.seen.bsdf[k].side(w.seen.d[k]) > 0) frame = Frame(-frame.n);
    V3f d = frame.to_world(square_to_cosine_hemisphere(V2f(w.u[i], w.v[i])));
    // What would leave through the surface is mirrored there: bent normals neither darken nor see what is behind.
    const V3f& Ng = w.seen.surface[k].Ng;
    const float height = dot(d, Ng);
    if (height * dot(Ng, w.seen.d[k]) > 0) d -= Ng * (2 * height);
    const uint32_t key = w.sobol_seed[i] ^ sobol::mix32(w.sobol_index[i]);
    w.batch.set(i, offset_origin(w.seen.surface[k], d), d, settings_.max_distance,
                w.camera.ray[w.seen.owner[k]].ray.time, key, w.seen.width[k], spread);
    w.medium[i] = scene::vacuum;
  }
  w.rays.diffuse += uint64_t(w.ray_count);
  if (!settings_.color_bleeding) {
    tracer_.visible(w.batch, w.ray_count, w.medium, w.passed, w.tracing);
    for (int i = 0; i < w.ray_count; ++i) w.open[w.ray_owner[i]] += w.passed[i];
    w.ray_count = 0;
    return;
  }
  tracer_.nearest(w.batch, w.ray_count, w.medium, &w.hits, w.distance, w.passed, w.tracing);
  auto& met = w.met;
  met.count = 0;
  for (int i = 0; i < w.ray_count; ++i) {
    const int k = w.ray_owner[i];
    if (w.hits.geometry[i] == no_id) {
      w.open[k] += w.passed[i];
      continue;
    }
    const int m = met.count++;
    met.owner[m] = k;
    met.geometry[m] = w.hits.geometry[i];
    met.surface[m] = scene_.traced.surface(w.hits, i, w.batch.time[i]);
    met.d[m] = w.batch.direction(i);
    met.passed[m] = w.passed[i];
    met.width[m] = w.seen.width[k] + w.distance[i] * spread;
  }
  w.prelight(materials_, met,
             [](const OcclusionWorkspace& ws, int k) { return ws.camera.ray[ws.seen.owner[k]].ray.time; });
  for (int m = 0; m < met.count; ++m) w.open[met.owner[m]] += met.passed[m] * met.bsdf[m].albedo() * 0.5f;
  w.ray_count = 0;
}

}  // namespace dapple::path
