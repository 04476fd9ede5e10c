// SPDX-License-Identifier: Apache-2.0
// The part of TracedScene that says what the surfaces are like which rays have met.
#include "dapple/trace/traced_scene.h"

namespace dapple::trace {

// Embree leaves u and v of disks to us, gives the tangents of flat curves for normals, v of ribbons from 0 to 1, and
// none of round curves.
void TracedScene::complete_hits(const RayBatch& r, int n, HitBatch* h) const {
  for (int i = 0; i < n; ++i) {
    if (h->geometry[i] == no_id) continue;
    const Shape& shape = geometries_[h->geometry[i]]->shape;
    if (const auto* disks = std::get_if<DisksPtr>(&shape)) {
      V3f p = r.origin(i) + r.direction(i) * h->t[i];
      if (h->instance[i] != no_id) p = object_point(instances_[h->instance[i]], p, r.time[i]);
      const V2f uv = (*disks)->parameters(h->primitive[i], p);
      h->u[i] = uv.x, h->v[i] = uv.y;
    } else if (const auto* curves = std::get_if<CurvesPtr>(&shape)) {
      if ((*curves)->kind == geom::CurveKind::ribbon) {
        h->v[i] = 2 * h->v[i] - 1;
        continue;
      }
      V3f view = -r.direction(i);
      if (h->instance[i] != no_id) {
        const Instance& at = instances_[h->instance[i]];
        view = object_point(at, view, r.time[i]) - object_point(at, V3f(0, 0, 0), r.time[i]);
      }
      if ((*curves)->kind == geom::CurveKind::flat) {
        h->nx[i] = view.x, h->ny[i] = view.y, h->nz[i] = view.z;
      } else {
        h->v[i] = (*curves)->across_tube(h->primitive[i], h->u[i], V3f(h->nx[i], h->ny[i], h->nz[i]), view);
      }
    }
  }
}

V3f TracedScene::object_point(const Instance& instance, const V3f& world, float time) const {
  float m[3][4];
  instance_transform(instance, time, m);
  const V3f c0(m[0][0], m[1][0], m[2][0]), c1(m[0][1], m[1][1], m[2][1]), c2(m[0][2], m[1][2], m[2][2]);
  const V3f k0 = cross(c1, c2), k1 = cross(c2, c0), k2 = cross(c0, c1), v = world - V3f(m[0][3], m[1][3], m[2][3]);
  return V3f(dot(k0, v), dot(k1, v), dot(k2, v)) * (1 / dot(c0, k0));
}

V3f TracedScene::instance_point(uint32_t instance, const V3f& p) const {
  const auto& m = instances_[instance].m;
  V3f out;
  for (int i = 0; i < 3; ++i) out[i] = m[i][0] * p.x + m[i][1] * p.y + m[i][2] * p.z + m[i][3];
  return out;
}

void TracedScene::instance_transform(const Instance& instance, float time, float m[3][4]) const {
  if (!instance.animated) {
    std::memcpy(m, instance.m, sizeof(instance.m));
    return;
  }
  float columns[12];
  rtcGetGeometryTransform(instance.animated, time, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 4; ++j) m[i][j] = columns[j * 3 + i];
}

geom::SurfacePoint TracedScene::local_surface(uint32_t geometry, uint32_t primitive, float u, float v, float time,
                                              const V3f& eye, bool tangents) const {
  const Shape& shape = geometries_[geometry]->shape;
  if (const auto* mesh = std::get_if<MeshPtr>(&shape)) return (*mesh)->at(primitive, u, v, time, tangents);
  if (const auto* grids = std::get_if<GridsPtr>(&shape)) return (*grids)->at(primitive, u, v, time, tangents);
  if (const auto* quadric = std::get_if<QuadricPtr>(&shape)) return (*quadric)->at(u, v);
  if (const auto* disks = std::get_if<DisksPtr>(&shape)) return (*disks)->at(primitive, u, v);
  return std::get<CurvesPtr>(shape)->at(primitive, u, v, eye);
}

geom::SurfacePoint TracedScene::surface(const HitBatch& h, int i, float time, bool tangents) const {
  const geom::SurfacePoint s =
      local_surface(h.geometry[i], h.primitive[i], h.u[i], h.v[i], time, V3f(h.nx[i], h.ny[i], h.nz[i]), tangents);
  return h.instance[i] == no_id ? s : to_world(s, h.instance[i], time, tangents);
}

void TracedScene::surfaces(const HitBatch& h, int i, std::span<const float> times, geom::SurfacePoint* out) const {
  const Shape& shape = geometries_[h.geometry[i]]->shape;
  const auto* mesh = std::get_if<MeshPtr>(&shape);
  const auto* grids = std::get_if<GridsPtr>(&shape);
  const bool deforms = (mesh && !(*mesh)->P_end.empty()) || (grids && !(*grids)->P_end.empty());
  geom::SurfacePoint local;
  for (size_t k = 0; k < times.size(); ++k) {
    if (k == 0 || deforms)
      local =
          local_surface(h.geometry[i], h.primitive[i], h.u[i], h.v[i], times[k], V3f(h.nx[i], h.ny[i], h.nz[i]), false);
    out[k] = h.instance[i] == no_id ? local : to_world(local, h.instance[i], times[k], false);
  }
}

geom::SurfacePoint TracedScene::surface_without_tangents(const RayBatch& rays, const HitBatch& h, int i) const {
  const Geometry& g = *geometries_[h.geometry[i]];
  if (const auto* grids = std::get_if<GridsPtr>(&g.shape)) {
    const auto s = (*grids)->at(h.primitive[i], h.u[i], h.v[i], rays.time[i], false);
    return h.instance[i] == no_id ? s : to_world(s, h.instance[i], rays.time[i], false);
  }
  const auto* mesh = std::get_if<MeshPtr>(&g.shape);
  if (!mesh) return surface(h, i, rays.time[i]);
  const V3f n(h.nx[i], h.ny[i], h.nz[i]);
  const float n2 = length2(n);
  if (period_ || !(*mesh)->N.empty() || h.instance[i] != no_id || !(n2 > 0) || !(n2 < infinity)) {
    const auto s = (*mesh)->at(h.primitive[i], h.u[i], h.v[i], rays.time[i], false);
    return h.instance[i] == no_id ? s : to_world(s, h.instance[i], rays.time[i], false);
  }
  geom::SurfacePoint s;
  const V3f o = rays.origin(i), along = rays.direction(i) * h.t[i];
  s.P = o + along;
  s.error = geom::position_error(abs(o) + abs(along));
  s.Ng = s.Ns = n * (((*mesh)->flip ? -1.0f : 1.0f) / std::sqrt(n2));
  return s;
}

geom::SurfacePoint TracedScene::to_world(const geom::SurfacePoint& local, uint32_t instance, float time,
                                         bool tangents) const {
  geom::SurfacePoint s = local;
  float m[3][4];
  instance_transform(instances_[instance], time, m);
  const V3f c0(m[0][0], m[1][0], m[2][0]), c1(m[0][1], m[1][1], m[2][1]), c2(m[0][2], m[1][2], m[2][2]);
  const V3f t(m[0][3], m[1][3], m[2][3]);
  const auto vector = [&](const V3f& v) { return c0 * v.x + c1 * v.y + c2 * v.z; };
  // Cofactors: det times the inverse transpose, with no division; the sign of det keeps the outside outside.
  const V3f k0 = cross(c1, c2), k1 = cross(c2, c0), k2 = cross(c0, c1);
  const float det = dot(c0, k0), sign = det < 0 ? -1.0f : 1.0f;
  const auto normal = [&](const V3f& v) { return (k0 * v.x + k1 * v.y + k2 * v.z) * sign; };
  const float scale = std::sqrt(std::max({length2(c0), length2(c1), length2(c2)}));
  s.P = vector(s.P) + t;
  s.error = s.error * scale + geom::position_error(abs(s.P) + abs(t));
  s.Ng = normalize(normal(s.Ng));
  const V3f ns = normal(s.Ns);
  const float inv = 1 / length(ns);
  s.Ns = ns * inv;
  if (!tangents) return s;
  s.dNdu = normal(s.dNdu) * inv;
  s.dNdv = normal(s.dNdv) * inv;
  s.dPdu = vector(s.dPdu);
  s.dPdv = vector(s.dPdv);
  return s;
}

void TracedScene::face_curve(HitBatch* h, int i, const V3f& eye, float time) const {
  const geom::CurveSet& curves = *std::get<CurvesPtr>(geometries_[h->geometry[i]]->shape);
  const geom::SurfacePoint s = curves.at(h->primitive[i], h->u[i], h->v[i], V3f(0, 0, 0));
  V3f e = eye;
  if (h->instance[i] != no_id) e = object_point(instances_[h->instance[i]], eye, time);
  V3f n = e - s.P;
  n -= s.dPdu * (dot(n, s.dPdu) / std::max(length2(s.dPdu), 1e-30f));
  if (curves.kind == geom::CurveKind::ribbon && !curves.normals.empty()) {
    const V3f* c = &curves.normals[h->primitive[i] * size_t(4)];
    n = face_forward(c[0] * (1 - h->u[i]) + c[3] * h->u[i], n);
    n -= s.dPdu * (dot(n, s.dPdu) / std::max(length2(s.dPdu), 1e-30f));
  }
  h->nx[i] = n.x, h->ny[i] = n.y, h->nz[i] = n.z;
}

}  // namespace dapple::trace
