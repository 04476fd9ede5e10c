// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/curve_set.h"

namespace dapple::geom {

size_t CurveSet::bytes() const {
  return control_points.size() * sizeof(ControlPoint) + normals.size() * sizeof(V3f) + u_range.size() * sizeof(V2f);
}

SurfacePoint CurveSet::at(uint32_t segment, float u, float v, const V3f& n_hit) const {
  const ControlPoint* c = &control_points[size_t(segment) * 4];
  const float w = 1 - u;
  const float b[4] = {w * w * w, 3 * u * w * w, 3 * u * u * w, u * u * u};
  const float d[4] = {-3 * w * w, 3 * w * w - 6 * u * w, 6 * u * w - 3 * u * u, 3 * u * u};
  V3f centre(0, 0, 0), tangent(0, 0, 0);
  float radius = 0;
  for (int i = 0; i < 4; ++i) {
    centre += c[i].P * b[i];
    tangent += c[i].P * d[i];
    radius += c[i].radius * b[i];
  }
  if (length2(tangent) == 0) tangent = c[3].P - c[0].P;
  if (length2(tangent) == 0) tangent = V3f(1, 0, 0);

  SurfacePoint s;
  const float n2 = length2(n_hit);
  V3f n = n2 > 0 ? n_hit * (1 / std::sqrt(n2)) : V3f(0, 0, 1);
  const V3f across = cross(n, tangent);
  const float across2 = length2(across);
  const V3f side = across2 > 0 ? across * (1 / std::sqrt(across2)) : V3f(1, 0, 0);
  if (kind == CurveKind::flat) {
    const V3f facing = cross(tangent, side);
    n = facing * (1 / std::max(length(facing), 1e-30f));
  }
  s.P = kind == CurveKind::round    ? centre + n * radius
        : kind == CurveKind::ribbon ? centre + side * (radius * v)
                                    : centre;
  s.Ng = s.Ns = n;
  s.dPdu = tangent * (1 / (u_range[segment].y - u_range[segment].x));
  s.dPdv = side * (2 * radius);
  s.u = lerp(u, u_range[segment].x, u_range[segment].y);
  s.v = 0.5f * (v + 1);
  // Embree subdivides curves, so hits lie off the analytic surface by a fraction of the radius: flat ones by what
  // build/curve_factory.cpp lets them.
  s.error = position_error(s.P) + (kind == CurveKind::flat ? 0.05f : 0.01f) * radius;
  return s;
}

float CurveSet::across_tube(uint32_t segment, float u, const V3f& n, const V3f& view) const {
  const V3f side = at(segment, u, 0, view).dPdv;
  const float scale = length2(n) * length2(side);
  return scale > 0 ? std::clamp(dot(n, side) / std::sqrt(scale), -1.0f, 1.0f) : 0;
}

}  // namespace dapple::geom
