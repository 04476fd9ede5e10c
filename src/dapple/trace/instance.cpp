// SPDX-License-Identifier: Apache-2.0
#include "dapple/trace/instance.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace dapple::trace {

void Instance::rows(float time, float out[3][4]) const {
  if (!animated) {
    std::memcpy(out, m, sizeof(m));
    return;
  }
  float columns[12];
  rtcGetGeometryTransform(animated, time, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 4; ++j) out[i][j] = columns[j * 3 + i];
}

V3f Instance::world_point(const V3f& p) const {
  V3f out;
  for (int i = 0; i < 3; ++i) out[i] = m[i][0] * p.x + m[i][1] * p.y + m[i][2] * p.z + m[i][3];
  return out;
}

V3f Instance::object_point(const V3f& world, float time) const {
  float now[3][4];
  rows(time, now);
  const V3f c0(now[0][0], now[1][0], now[2][0]), c1(now[0][1], now[1][1], now[2][1]),
      c2(now[0][2], now[1][2], now[2][2]);
  const V3f k0 = cross(c1, c2), k1 = cross(c2, c0), k2 = cross(c0, c1),
            v = world - V3f(now[0][3], now[1][3], now[2][3]);
  return V3f(dot(k0, v), dot(k1, v), dot(k2, v)) * (1 / dot(c0, k0));
}

geom::SurfacePoint Instance::to_world(const geom::SurfacePoint& local, float time, bool tangents) const {
  geom::SurfacePoint s = local;
  float now[3][4];
  rows(time, now);
  const V3f c0(now[0][0], now[1][0], now[2][0]), c1(now[0][1], now[1][1], now[2][1]),
      c2(now[0][2], now[1][2], now[2][2]);
  const V3f t(now[0][3], now[1][3], now[2][3]);
  const auto vector = [&](const V3f& v) { return c0 * v.x + c1 * v.y + c2 * v.z; };
  // Cofactors: det times the inverse transpose, with no division; the sign of det keeps the outside outside.
  const V3f k0 = cross(c1, c2), k1 = cross(c2, c0), k2 = cross(c0, c1);
  const float det = dot(c0, k0), sign = det < 0 ? -1.0f : 1.0f;
  const auto normal = [&](const V3f& v) { return (k0 * v.x + k1 * v.y + k2 * v.z) * sign; };
  const float longest = std::sqrt(std::max({length2(c0), length2(c1), length2(c2)}));
  s.P = vector(s.P) + t;
  s.error = s.error * longest + geom::position_error(abs(s.P) + abs(t));
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

Instance instance_of(uint32_t object, const AnimatedTransform& motion, RTCGeometry geometry) {
  Instance instance{};
  const M44d& m = motion.start().matrix();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 4; ++j) instance.m[i][j] = float(m[i][j]);
  for (int j = 0; j < 3; ++j)
    instance.scale = std::max(instance.scale, length(V3f(instance.m[0][j], instance.m[1][j], instance.m[2][j])));
  instance.object = object;
  instance.animated = geometry;
  return instance;
}

}  // namespace dapple::trace
