// SPDX-License-Identifier: Apache-2.0
#include "dapple/scene/scene.h"

namespace dapple::scene {

void Scene::set_point(const geom::SurfacePoint& s, const V3f& d, float width, float time, uint64_t key,
                      pattern::ShadingPoints* p, int i) {
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
                      pattern::ShadingPoints* p, int i) {
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

template <class T>
void Scene::evaluate(const pattern::Texture<T>& texture, uint32_t geometry, int n, const uint32_t* primitive,
                     const float* u, const float* v, const float* time, T* out) const {
  if (const auto value = texture.constant()) {
    std::fill_n(out, n, *value);
    return;
  }
  pattern::ShadingPoints points;
  points.count = n;
  for (int i = 0; i < n; ++i) {
    const geom::SurfacePoint s = traced.local_surface(geometry, primitive[i], u[i], v[i], time[i]);
    set_point(s, -s.Ng, 0, time[i], 0, &points, i);
  }
  texture.evaluate(points, out);
}

void Scene::opacity(uint32_t geometry, int n, const uint32_t* primitive, const float* u, const float* v,
                    const float* time, float* alpha) const {
  evaluate(*bindings[geometry].alpha, geometry, n, primitive, u, v, time, alpha);
}

void Scene::colored_opacity(uint32_t geometry, int n, const uint32_t* primitive, const float* u, const float* v,
                            const float* time, RGB* alpha) const {
  if (bindings[geometry].opacity)
    return evaluate(*bindings[geometry].opacity, geometry, n, primitive, u, v, time, alpha);
  OpacityTest::colored_opacity(geometry, n, primitive, u, v, time, alpha);
}

}  // namespace dapple::scene
