// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/mesh.h"

namespace dapple::geom {

size_t Mesh::bytes() const {
  return (P.size() + P_end.size() + N.size()) * sizeof(V3f) + uv.size() * sizeof(V2f) +
         (indices.size() + source_face.size()) * sizeof(uint32_t);
}

void Mesh::corners_at(uint32_t face, float time, V3f out[4]) const {
  const uint32_t* index = &indices[size_t(face) * size_t(corners)];
  for (int i = 0; i < corners; ++i)
    out[i] = P_end.empty() ? P[index[i]] : P[index[i]] * (1 - time) + P_end[index[i]] * time;
}

SurfacePoint Mesh::at(uint32_t face, float u, float v, float time, bool tangents) const {
  V3f c[4], n[4];
  V2f t[4];
  corners_at(face, time, c);
  const uint32_t* index = &indices[size_t(face) * size_t(corners)];
  for (int i = 0; i < corners && !N.empty(); ++i) n[i] = N[index[i]];
  for (int i = 0; i < corners && !uv.empty(); ++i) t[i] = uv[index[i]];
  SurfacePoint s;
  if (corners == 3) {
    complete_triangle(c, N.empty() ? nullptr : n, uv.empty() ? nullptr : t, u, v, flip, tangents, &s);
    return s;
  }
  // Embree splits a quad into (0, 1, 3) and (2, 3, 1); the hit lies on one of them.
  if (uv.empty()) t[0] = V2f(0, 0), t[1] = V2f(1, 0), t[2] = V2f(1, 1), t[3] = V2f(0, 1);
  const bool first = u + v <= 1;
  const int a = first ? 0 : 2, b = first ? 1 : 3, d = first ? 3 : 1;
  const V3f tri_c[3] = {c[a], c[b], c[d]}, tri_n[3] = {n[a], n[b], n[d]};
  const V2f tri_t[3] = {t[a], t[b], t[d]};
  complete_triangle(tri_c, N.empty() ? nullptr : tri_n, tri_t, first ? u : 1 - u, first ? v : 1 - v, flip, tangents,
                    &s);
  return s;
}

V2f Mesh::uv_at(uint32_t face, float u, float v, float* area) const {
  const uint32_t* index = &indices[size_t(face) * size_t(corners)];
  V2f t0 = uv[index[0]], t1 = uv[index[1]], t2 = uv[index[corners == 3 ? 2 : 3]];
  if (corners == 4 && u + v > 1) t0 = uv[index[2]], t2 = t1, t1 = uv[index[3]], u = 1 - u, v = 1 - v;
  const V2f e1 = t1 - t0, e2 = t2 - t0;
  *area = std::abs(e1.x * e2.y - e1.y * e2.x);
  const float w = 1 - u - v;
  return {t0.x * w + t1.x * u + t2.x * v, t0.y * w + t1.y * u + t2.y * v};
}

}  // namespace dapple::geom
