// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/motion_tracer.h"

#include <cmath>

#include "dapple/base/parallel.h"
#include "dapple/integrate/camera_batch.h"
#include "dapple/scene/camera_matrices.h"

namespace dapple::integrate {

using trace::no_id;

namespace {

/// Where a camera shows things at one time.
class Screen {
 public:
  Screen(const scene::Camera& camera, const scene::CameraMatrices& m)
      : to_ndc_(*m.world_to_ndc), to_camera_(m.world_to_camera), size_(camera.settings().resolution) {}

  /// x, y: pixels from the upper left; z: depth. Not finite where the camera cannot see it.
  V3d of_point(const V3d& p) const { return of(p, 1); }
  V3d of_direction(const V3f& d) const { return of(V3d(d), 0); }

 private:
  V3d of(const V3d& v, double w) const {
    const auto dot4 = [&](const M44d& m, int column) {
      return v.x * m[0][column] + v.y * m[1][column] + v.z * m[2][column] + w * m[3][column];
    };
    const double inverse = 1 / dot4(to_ndc_, 3);
    if (!(inverse > 0)) return V3d(double(infinity));
    return {dot4(to_ndc_, 0) * inverse * size_.x, dot4(to_ndc_, 1) * inverse * size_.y, w * dot4(to_camera_, 2)};
  }

  const M44d to_ndc_, to_camera_;
  const V2i size_;
};

struct Mean {
  V3d sum{0, 0, 0};
  double weight = 0;
  void add(const V3d& v, float w) {
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z)) return;
    sum += v * double(w), weight += double(w);
  }
};

}  // namespace

struct MotionTracer::Workspace {
  Screen open, close;  ///< close: of the neighbour, where there is one
  const NeighbourScene* to;
  CameraBatch camera;
  StopToken stop;
  Mean met[CameraBatch::capacity], sky[CameraBatch::capacity];
  trace::RayBatch rays;
  trace::HitBatch hits;
  RayTracer::Scratch tracing;
  int32_t medium[CameraBatch::capacity];
  float distance[CameraBatch::capacity];
  RGB passed[CameraBatch::capacity];

  Workspace(const scene::Camera& c, const NeighbourScene* neighbour)
      : open(c, scene::camera_matrices(c)),
        close(neighbour ? Screen(neighbour->scene.camera, scene::camera_matrices(neighbour->scene.camera))
                        : Screen(c, scene::camera_matrices_at_close(c))),
        to(neighbour) {}
};

bool MotionTracer::can_trace(const scene::Scene& scene) {
  return scene::camera_matrices(scene.camera).world_to_ndc.has_value();
}

std::vector<V3f> MotionTracer::trace(const Box2i& pixels, const NeighbourScene* to, StopToken stop) const {
  const int width = pixels.max.x - pixels.min.x, height = pixels.max.y - pixels.min.y;
  std::vector<V3f> out(size_t(width) * size_t(height), V3f(0, 0, 0));
  if (!can_trace(scene_) || (to && !can_trace(to->scene))) return out;
  const double frame = to ? 1 : double(scene_.camera.shutters_a_frame());
  std::vector<Box2i> blocks;
  CameraBatch::for_each_block(pixels, [&](const Box2i& block) { blocks.push_back(block); });
  parallel_for(blocks.size(), [&](size_t i) {
    const auto w = std::make_unique<Workspace>(scene_.camera, to);
    w->stop = w->tracing.stop = stop;
    trace_block(blocks[i], *w);
    for (int p = 0; p < w->camera.count; ++p) {
      const Mean& m = w->met[p].weight > 0 ? w->met[p] : w->sky[p];
      if (!(m.weight > 0)) continue;
      const V2i at = w->camera.pixel[p] - pixels.min;
      out[size_t(at.y) * size_t(width) + size_t(at.x)] = V3f(m.sum * (frame / m.weight));
    }
  });
  return out;
}

void MotionTracer::trace_block(const Box2i& block, Workspace& w) const {
  const PixelSets sets(settings_.pixel_samples, settings_.seed);
  for (int s = 0; s < settings_.samples; ++s) {
    w.stop.check();
    w.camera.generate(scene_, block, uint32_t(s), sets);
    for (int p = 0; p < w.camera.count; ++p) {
      const scene::CameraRay& r = w.camera.ray[p];
      w.rays.set(p, r.ray.o, r.ray.d, infinity, r.ray.time, trace::ray_key(w.camera.seed[p], w.camera.index[p]),
                 r.cone_width, r.cone_spread);
      w.medium[p] = scene::vacuum;
    }
    tracer_.nearest(w.rays, w.camera.count, w.medium, &w.hits, w.distance, w.passed, w.tracing);
    for (int p = 0; p < w.camera.count; ++p) {
      const V3f& d = w.camera.ray[p].ray.d;
      if (w.hits.geometry[p] == no_id)
        w.sky[p].add(w.close.of_direction(d) - w.open.of_direction(d), w.camera.film_weight[p]);
      else
        add_hit(p, w);
    }
  }
}

void MotionTracer::add_hit(int p, Workspace& w) const {
  const scene::Camera::Settings& camera = scene_.camera.settings();
  const Ray& ray = w.camera.ray[p].ray;
  const float times[3] = {camera.time_open, camera.time_close, ray.time};
  geom::SurfacePoint at[3];
  scene_.traced.surfaces(w.hits, p, times, at);
  // Of scenes with a period the surface may be that of another cell.
  const V3f shift = ray.o + ray.d * w.distance[p] - at[2].P;
  V3d end = V3d(at[1].P + shift);
  if (w.to) {
    const float opens[1] = {w.to->scene.camera.settings().time_open};
    geom::SurfacePoint there[1];
    if (w.to->same.rename(&w.hits, p)) {
      w.to->scene.traced.surfaces(w.hits, p, opens, there);
      end = V3d(there[0].P + shift);
    } else {
      const double frames = w.to->frames * double(scene_.camera.shutters_a_frame());
      end = V3d(at[0].P + shift) + V3d(at[1].P - at[0].P) * frames + w.to->shift;
    }
  }
  w.met[p].add(w.close.of_point(end) - w.open.of_point(V3d(at[0].P + shift)), w.camera.film_weight[p]);
}

}  // namespace dapple::integrate
