// SPDX-License-Identifier: Apache-2.0
#include "dapple/integrate/shadow_tracer.h"

#include "dapple/integrate/ray_origin.h"
#include "dapple/shading/medium.h"

namespace dapple::integrate {

namespace {
constexpr int max_segments = 4096;  // ends a ray caught between surfaces that are not there
}

void ShadowTracer::trace(const trace::RayBatch& rays, int n, const int32_t* medium, RGB* visible, Scratch& scratch) const {
  if (materials_.shadows_pass()) return trace_through(rays, n, medium, visible, scratch);
  scene_.traced.occluded(rays, n, scratch.occluded);
  for (int i = 0; i < n; ++i) visible[i] = RGB(scratch.occluded[i] ? 0.0f : 1.0f);
}

// From surface to surface.
void ShadowTracer::trace_through(const trace::RayBatch& rays, int n, const int32_t* medium, RGB* visible, Scratch& s) const {
  for (int i = 0; i < n; ++i) {
    s.rays.set(i, rays.origin(i), rays.direction(i), rays.t_max[i], rays.time[i], rays.key[i]);
    s.medium[i] = medium[i];
    s.ray[i] = i;
    visible[i] = RGB(1);
  }
  for (int segment = 0; n > 0 && segment < max_segments; ++segment) {
    scene_.traced.intersect(s.rays, n, &s.hits);
    int kept = 0;
    for (int i = 0; i < n; ++i) {
      const int r = s.ray[i];
      const bool hit = s.hits.geometry[i] != trace::no_id;
      if (hit && !materials_.passes(s.hits.geometry[i])) {
        visible[r] = RGB();
        continue;
      }
      const V3f o = s.rays.origin(i), d = s.rays.direction(i);
      const float t = hit ? s.hits.t[i] : s.rays.t_max[i], time = s.rays.time[i];
      if (s.medium[i] != scene::vacuum)
        visible[r] *= scene_.media[size_t(s.medium[i])]->transmittance({o, d, infinity, time}, t, hash(rays.key[r], segment));
      if (!hit || visible[r].is_black()) continue;
      const geom::SurfacePoint p = scene_.traced.surface_without_tangents(s.rays, s.hits, i);
      const scene::GeometryBinding& binding = scene_.bindings[s.hits.geometry[i]];
      const int32_t behind = binding.medium_beyond(d, p.Ng, s.medium[i]);
      s.rays.set(kept, offset_origin(p, d), d, s.rays.t_max[i] - t, time, uint32_t(hash(rays.key[r], segment, 1)));
      s.medium[kept] = behind;
      s.ray[kept++] = r;
    }
    n = kept;
  }
}

}  // namespace dapple::integrate
