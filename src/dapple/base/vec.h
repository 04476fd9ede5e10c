// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace dapple {
inline namespace base {

using Imath::Box2f;
using Imath::Box2i;
using Imath::Box3f;
using Imath::M44d;
using Imath::M44f;
using Imath::V2f;
using Imath::V2i;
using Imath::V3d;
using Imath::V3f;

inline constexpr float pi = std::numbers::pi_v<float>;
inline constexpr float inv_pi = std::numbers::inv_pi_v<float>;
inline constexpr float infinity = std::numeric_limits<float>::infinity();
/// The largest float below one: what a uniform random number may be.
inline constexpr float one_minus_epsilon = 0x1.fffffep-1f;

inline float dot(const V3f& a, const V3f& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline V3f cross(const V3f& a, const V3f& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline float length2(const V3f& v) {
  return dot(v, v);
}
inline float length(const V3f& v) {
  return std::sqrt(dot(v, v));
}
/// v / |v|. The zero vector gives NaN: callers that may meet one test first.
inline V3f normalize(const V3f& v) {
  return v * (1.0f / std::sqrt(dot(v, v)));
}
inline V3f abs(const V3f& v) {
  return {std::abs(v.x), std::abs(v.y), std::abs(v.z)};
}
inline bool is_finite(const V3f& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}
inline V3f face_forward(const V3f& n, const V3f& v) {
  return dot(n, v) < 0 ? -n : n;
}
inline constexpr float sqr(float x) {
  return x * x;
}
inline constexpr float lerp(float t, float a, float b) {
  return (1 - t) * a + t * b;
}
inline constexpr float radians(float degrees) {
  return degrees * (pi / 180);
}
inline constexpr float degrees(float radians) {
  return radians * (180 / pi);
}
/// sqrt that takes the small negative numbers round-off leaves as zero.
inline float safe_sqrt(float x) {
  return std::sqrt(std::max(x, 0.0f));
}

/// Two unit vectors that complete unit n to a right-handed orthonormal frame (Duff et al. 2017).
inline void coordinate_system(const V3f& n, V3f* s, V3f* t) {
  const float sign = std::copysign(1.0f, n.z);
  const float a = -1 / (sign + n.z);
  const float b = n.x * n.y * a;
  *s = {1 + sign * n.x * n.x * a, sign * b, -sign * n.x};
  *t = {b, sign + n.y * n.y * a, -n.y};
}

/// An orthonormal frame: s and t span the surface, n is the (shading) normal.
struct Frame {
  V3f s{1, 0, 0}, t{0, 1, 0}, n{0, 0, 1};

  Frame() = default;
  explicit Frame(const V3f& normal) : n(normal) { coordinate_system(n, &s, &t); }
  /// Normal n (unit); s is the part of tangent orthogonal to n, or arbitrary where there is none.
  Frame(const V3f& normal, const V3f& tangent) : n(normal) {
    const V3f p = tangent - n * dot(n, tangent);
    const float l2 = length2(p);
    if (l2 > 1e-20f && std::isfinite(l2)) {
      s = p * (1 / std::sqrt(l2));
      t = cross(n, s);
    } else {
      coordinate_system(n, &s, &t);
    }
  }
  V3f to_local(const V3f& v) const { return {dot(v, s), dot(v, t), dot(v, n)}; }
  V3f to_world(const V3f& v) const { return s * v.x + t * v.y + n * v.z; }
};

}  // namespace base
}  // namespace dapple
