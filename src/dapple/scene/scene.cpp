// SPDX-License-Identifier: Apache-2.0
#include "dapple/scene/scene.h"

namespace dapple::scene {

void Scene::set_point(const geom::SurfacePoint& s, const V3f& d, float width, float time, uint64_t key,
                      shading::ShadingPoints* p, int i) {
  // The cone meets the tangent plane in an ellipse, long along the direction of travel.
  const float c = dot(d, s.Ng);
  V3f along = d - s.Ng * c;
  const float l2 = length2(along);
  V3f across;
  if (l2 > 1e-12f) {
    along *= 1 / std::sqrt(l2);
    across = cross(s.Ng, along);
  } else {
    coordinate_system(s.Ng, &along, &across);
  }
  set_point(s, along * (width / std::max(std::abs(c), 0.05f)), across * width, time, key, p, i);
}

void Scene::set_point(const geom::SurfacePoint& s, const V3f& dx, const V3f& dy, float time, uint64_t key,
                      shading::ShadingPoints* p, int i) {
  p->P.set(i, s.P);
  p->Ng.set(i, s.Ng);
  p->Ns.set(i, s.Ns);
  p->dPdu.set(i, s.dPdu);
  p->dPdv.set(i, s.dPdv);
  p->dNdu.set(i, s.dNdu);
  p->dNdv.set(i, s.dNdv);
  p->u[i] = s.u;
  p->v[i] = s.v;
  p->time[i] = time;
  p->key[i] = key;
  p->dPdx.set(i, dx);
  p->dPdy.set(i, dy);
  // Least squares of dP = dPdu du + dPdv dv.
  const float a = dot(s.dPdu, s.dPdu), b = dot(s.dPdu, s.dPdv), e = dot(s.dPdv, s.dPdv);
  const float det = a * e - b * b;
  const float inv = det > 1e-12f * a * e ? 1 / det : 0;
  const auto solve = [&](const V3f& dp, float* du, float* dv) {
    const float x = dot(s.dPdu, dp), y = dot(s.dPdv, dp);
    *du = std::clamp((e * x - b * y) * inv, -1e8f, 1e8f);
    *dv = std::clamp((a * y - b * x) * inv, -1e8f, 1e8f);
  };
  solve(dx, &p->dudx[i], &p->dvdx[i]);
  solve(dy, &p->dudy[i], &p->dvdy[i]);
}

void Scene::opacity(uint32_t geometry, int n, const uint32_t* primitive, const float* u, const float* v,
                    const float* time, float* alpha) const {
  const shading::FloatTexture& texture = *bindings[geometry].alpha;
  if (const auto value = texture.constant()) {
    std::fill_n(alpha, n, *value);
    return;
  }
  shading::ShadingPoints points;
  points.count = n;
  const trace::Shape& shape = traced.shape(geometry);
  for (int i = 0; i < n; ++i) {
    geom::SurfacePoint s;
    if (const auto* mesh = std::get_if<trace::MeshPtr>(&shape))
      s = (*mesh)->at(primitive[i], u[i], v[i], time[i]);
    else if (const auto* grids = std::get_if<trace::GridsPtr>(&shape))
      s = (*grids)->at(primitive[i], u[i], v[i], time[i]);
    else if (const auto* quadric = std::get_if<trace::QuadricPtr>(&shape))
      s = (*quadric)->at(u[i], v[i]);
    else if (const auto* disks = std::get_if<trace::DisksPtr>(&shape))
      s = (*disks)->at(primitive[i], u[i], v[i]);
    else
      s = std::get<trace::CurvesPtr>(shape)->at(primitive[i], u[i], v[i], V3f(0, 0, 1));
    set_point(s, -s.Ng, 0, time[i], 0, &points, i);
  }
  texture.evaluate(points, alpha);
}

}  // namespace dapple::scene
