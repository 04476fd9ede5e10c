// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/surface_point.h"

namespace dapple::geom {

void complete_triangle(const V3f c[3], const V3f* normals, const V2f* uv, float b1, float b2, bool flip, bool tangents,
                       SurfacePoint* out) {
  const float b0 = 1 - b1 - b2;
  const V3f e1 = c[1] - c[0], e2 = c[2] - c[0];
  out->P = c[0] * b0 + c[1] * b1 + c[2] * b2;
  out->error = position_error(abs(c[0]) * b0 + abs(c[1]) * b1 + abs(c[2]) * b2);

  V3f n = cross(e1, e2);
  const float n2 = length2(n);
  n = n2 > 0 ? n * (1 / std::sqrt(n2)) : V3f(0, 0, 1);
  if (flip) n = -n;

  V2f t1(1, 0), t2(1, 1), t0(0, 0);
  if (uv) t0 = uv[0], t1 = uv[1], t2 = uv[2];
  out->u = t0.x * b0 + t1.x * b1 + t2.x * b2;
  out->v = t0.y * b0 + t1.y * b1 + t2.y * b2;
  out->Ns = n;
  if (normals) {
    const V3f ns = normals[0] * b0 + normals[1] * b1 + normals[2] * b2;
    const float l2 = length2(ns);
    if (l2 > 0) {
      // Normals of the file say where outside is, as in pbrt-v4.
      out->Ns = ns * (1 / std::sqrt(l2));
      if (dot(n, out->Ns) < 0) n = -n;
    }
  }
  out->Ng = n;
  if (!tangents) return;

  const float du1 = t1.x - t0.x, du2 = t2.x - t0.x, dv1 = t1.y - t0.y, dv2 = t2.y - t0.y;
  const float det = du1 * dv2 - dv1 * du2;
  out->dNdu = out->dNdv = V3f(0, 0, 0);
  if (std::abs(det) < 1e-12f) {
    coordinate_system(n, &out->dPdu, &out->dPdv);
    return;
  }
  const float inv = 1 / det;
  out->dPdu = (e1 * dv2 - e2 * dv1) * inv;
  out->dPdv = (e2 * du1 - e1 * du2) * inv;
  if (!normals) return;
  const V3f ns = normals[0] * b0 + normals[1] * b1 + normals[2] * b2;
  const float scale = length2(ns) > 0 ? inv / length(ns) : 0;
  const V3f n1 = normals[1] - normals[0], n2v = normals[2] - normals[0];
  out->dNdu = (n1 * dv2 - n2v * dv1) * scale;
  out->dNdv = (n2v * du1 - n1 * du2) * scale;
}

}  // namespace dapple::geom
