// SPDX-License-Identifier: Apache-2.0
#include "dapple/trace/traced_shapes.h"

#include <algorithm>
#include <cmath>

namespace dapple::trace {

// Embree leaves u and v of disks to us, gives the tangents of flat curves for normals, v of ribbons from 0 to 1, and
// none of round curves.
void TracedShapes::complete(const RayBatch& r, int n, HitBatch* h) const {
  for (int i = 0; i < n; ++i) {
    if (h->geometry[i] == no_id) continue;
    const Shape& shape = shapes_[h->geometry[i]];
    if (const auto* disks = std::get_if<DisksPtr>(&shape)) {
      V3f p = r.origin(i) + r.direction(i) * h->t[i];
      if (h->instance[i] != no_id) p = instance(h->instance[i]).object_point(p, r.time[i]);
      const V2f uv = (*disks)->parameters(h->primitive[i], p);
      h->u[i] = uv.x, h->v[i] = uv.y;
    } else if (const auto* curves = std::get_if<CurvesPtr>(&shape)) {
      if ((*curves)->kind == geom::CurveKind::ribbon) {
        h->v[i] = 2 * h->v[i] - 1;
        continue;
      }
      V3f view = -r.direction(i);
      if (h->instance[i] != no_id) {
        const Instance at = instance(h->instance[i]);
        view = at.object_point(view, r.time[i]) - at.object_point(V3f(0, 0, 0), r.time[i]);
      }
      if ((*curves)->kind == geom::CurveKind::flat) {
        h->nx[i] = view.x, h->ny[i] = view.y, h->nz[i] = view.z;
      } else {
        h->v[i] = (*curves)->across_tube(h->primitive[i], h->u[i], V3f(h->nx[i], h->ny[i], h->nz[i]), view);
      }
    }
  }
}

geom::SurfacePoint TracedShapes::local_surface(uint32_t geometry, uint32_t primitive, float u, float v, float time,
                                               const V3f& eye, bool tangents) const {
  const Shape& shape = shapes_[geometry];
  if (const auto* mesh = std::get_if<MeshPtr>(&shape)) return (*mesh)->at(primitive, u, v, time, tangents);
  if (const auto* grids = std::get_if<GridsPtr>(&shape)) return (*grids)->at(primitive, u, v, time, tangents);
  if (const auto* quadric = std::get_if<QuadricPtr>(&shape)) return (*quadric)->at(u, v);
  if (const auto* disks = std::get_if<DisksPtr>(&shape)) return (*disks)->at(primitive, u, v);
  return std::get<CurvesPtr>(shape)->at(primitive, u, v, eye);
}

geom::SurfacePoint TracedShapes::surface(const HitBatch& h, int i, float time, bool tangents) const {
  const geom::SurfacePoint s =
      local_surface(h.geometry[i], h.primitive[i], h.u[i], h.v[i], time, V3f(h.nx[i], h.ny[i], h.nz[i]), tangents);
  return h.instance[i] == no_id ? s : instance(h.instance[i]).to_world(s, time, tangents);
}

void TracedShapes::surfaces(const HitBatch& h, int i, std::span<const float> times, geom::SurfacePoint* out) const {
  const Shape& shape = shapes_[h.geometry[i]];
  const auto* mesh = std::get_if<MeshPtr>(&shape);
  const auto* grids = std::get_if<GridsPtr>(&shape);
  const bool deforms = (mesh && !(*mesh)->P_end.empty()) || (grids && !(*grids)->P_end.empty());
  geom::SurfacePoint local;
  for (size_t k = 0; k < times.size(); ++k) {
    if (k == 0 || deforms)
      local =
          local_surface(h.geometry[i], h.primitive[i], h.u[i], h.v[i], times[k], V3f(h.nx[i], h.ny[i], h.nz[i]), false);
    out[k] = h.instance[i] == no_id ? local : instance(h.instance[i]).to_world(local, times[k], false);
  }
}

geom::SurfacePoint TracedShapes::surface_without_tangents(const RayBatch& rays, const HitBatch& h, int i,
                                                          bool is_straight) const {
  const Shape& shape = shapes_[h.geometry[i]];
  if (const auto* grids = std::get_if<GridsPtr>(&shape)) {
    const auto s = (*grids)->at(h.primitive[i], h.u[i], h.v[i], rays.time[i], false);
    return h.instance[i] == no_id ? s : instance(h.instance[i]).to_world(s, rays.time[i], false);
  }
  const auto* mesh = std::get_if<MeshPtr>(&shape);
  if (!mesh) return surface(h, i, rays.time[i]);
  const V3f n(h.nx[i], h.ny[i], h.nz[i]);
  const float n2 = length2(n);
  if (!is_straight || !(*mesh)->N.empty() || h.instance[i] != no_id || !(n2 > 0) || !(n2 < infinity)) {
    const auto s = (*mesh)->at(h.primitive[i], h.u[i], h.v[i], rays.time[i], false);
    return h.instance[i] == no_id ? s : instance(h.instance[i]).to_world(s, rays.time[i], false);
  }
  geom::SurfacePoint s;
  const V3f o = rays.origin(i), along = rays.direction(i) * h.t[i];
  s.P = o + along;
  s.error = geom::position_error(abs(o) + abs(along));
  s.Ng = s.Ns = n * (((*mesh)->flip ? -1.0f : 1.0f) / std::sqrt(n2));
  return s;
}

}  // namespace dapple::trace
