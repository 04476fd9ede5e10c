// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/triangle_emitter.h"

#include <utility>

#include "dapple/numeric/warp.h"

namespace dapple::geom {
namespace {

V3d to_double(const V3f& v) {
  return V3d(v.x, v.y, v.z);
}

/// The triangle seen from a point, projected on the unit sphere. Double precision: small triangles are differences of
/// nearly equal unit vectors.
struct SphericalTriangle {
  V3d A, B, C;             // vertices relative to the point
  V3d a, b, c;             // the same, unit
  double det = 0;          // |a . (b x c)|
  double solid_angle = 0;  // 0 where it is outside the range for spherical sampling

  SphericalTriangle(const V3f& ref, const V3f& p0, const V3f& p1, const V3f& p2) {
    if (is_small(ref, p0, p1, p2)) return;
    const V3d o = to_double(ref);
    A = to_double(p0) - o, B = to_double(p1) - o, C = to_double(p2) - o;
    const double la = A.length(), lb = B.length(), lc = C.length();
    if (!(la > 0 && lb > 0 && lc > 0)) return;
    a = A / la, b = B / lb, c = C / lc;
    det = std::abs(a.dot((b - a).cross(c - a)));
    // Van Oosterom & Strackee 1983.
    const double omega = 2 * std::atan2(det, 1 + a.dot(b) + b.dot(c) + c.dot(a));
    if (omega >= TriangleEmitter::min_solid_angle && omega <= TriangleEmitter::max_solid_angle) solid_angle = omega;
  }

  /// True where the triangle is so small or far that points uniform in area are as good: they cost a sixth.
  static bool is_small(const V3f& ref, const V3f& p0, const V3f& p1, const V3f& p2) {
    const V3f centre = (p0 + p1 + p2) * (1.0f / 3);
    const float r2 = std::max({length2(p0 - centre), length2(p1 - centre), length2(p2 - centre)});
    return r2 < sqr(TriangleEmitter::small_angle) * length2(centre - ref);
  }

  /// A direction uniform in the triangle (Arvo 1995): u.x cuts off a sub-triangle a, b, c2; u.y walks from b towards
  /// c2.
  V3d sample(const V2f& u) const {
    const double cos_c = a.dot(b), cos_b = a.dot(c);
    const double num = b.dot(c) - cos_c * cos_b, hyp = std::hypot(num, det);
    const double cos_alpha = num / hyp, sin_alpha = det / hyp;
    const double area = u.x * solid_angle, sin_area = std::sin(area), cos_area = std::cos(area);
    const double s = sin_area * cos_alpha - cos_area * sin_alpha;
    const double t = cos_area * cos_alpha + sin_area * sin_alpha;
    const double x = t - cos_alpha, y = s + sin_alpha * cos_c;
    const double q0 = ((y * t - x * s) * cos_alpha - y) / ((y * s + x * t) * sin_alpha);
    const double q = q0 <= 1 ? std::max(q0, -1.0) : 1;  // also for the 0/0 of u.x = 0
    const V3d c2 = a * q + (c - a * cos_b).normalized() * std::sqrt(1 - q * q);
    const double cos_c2 = c2.dot(b), h = u.y * (1 - cos_c2);
    return b * (1 - h) + (c2 - b * cos_c2).normalized() * std::sqrt(h * (2 - h));
  }
};

static_assert(sizeof(TriangleEmitter) <= 48);

}  // namespace

TriangleEmitter::TriangleEmitter(const V3f& p0, const V3f& p1, const V3f& p2, bool flip, const std::optional<UV>& uv)
    : p0_(p0), p1_(p1), p2_(p2), swapped_(flip) {
  if (flip) std::swap(p1_, p2_);
  if (!uv) return;
  UV ordered = *uv;
  if (flip) std::swap(ordered[1], ordered[2]);
  uv_ = std::make_unique<const UV>(ordered);
}

V2f TriangleEmitter::uv_at(const V3f& b) const {
  if (uv_) return (*uv_)[0] * b.x + (*uv_)[1] * b.y + (*uv_)[2] * b.z;
  const float b1 = swapped_ ? b.z : b.y, b2 = swapped_ ? b.y : b.z;
  return {b1 + b2, b2};
}

float TriangleEmitter::area() const {
  return 0.5f * length(cross(p1_ - p0_, p2_ - p0_));
}

V3f TriangleEmitter::normal() const {
  return normalize(cross(p1_ - p0_, p2_ - p0_));
}

Box3f TriangleEmitter::bounds() const {
  Box3f box(p0_);
  box.extendBy(p1_);
  box.extendBy(p2_);
  return box;
}

uint32_t TriangleEmitter::sample(const V3f& ref, std::span<const V2f> u, EmitterSample* out) const {
  const SphericalTriangle spherical(ref, p0_, p1_, p2_);
  const bool by_angle = spherical.solid_angle > 0;
  const V3f n = normal();
  const float density = by_angle ? static_cast<float>(1 / spherical.solid_angle) : 1 / area();
  uint32_t drawn = 0;
  for (size_t i = 0; i < u.size(); ++i) {
    V3f b;
    if (by_angle) {
      const V3d w = spherical.sample(u[i]);
      const double b0 = std::abs(w.dot(spherical.B.cross(spherical.C)));
      const double b1 = std::abs(w.dot(spherical.C.cross(spherical.A)));
      const double b2 = std::abs(w.dot(spherical.A.cross(spherical.B)));
      const double sum = b0 + b1 + b2;
      if (!(sum > 0)) continue;
      b = {static_cast<float>(b0 / sum), static_cast<float>(b1 / sum), static_cast<float>(b2 / sum)};
    } else {
      const V2f b01 = square_to_triangle(u[i]);
      b = {b01.x, b01.y, 1 - b01.x - b01.y};
    }
    out[i].p = p0_ * b.x + p1_ * b.y + p2_ * b.z;
    out[i].n = n;
    out[i].uv = uv_at(b);
    out[i].pdf = density;
    if (by_angle || area_to_solid_angle(ref, out[i].p, n, density, &out[i].pdf)) drawn |= 1u << i;
  }
  return drawn;
}

float TriangleEmitter::pdf(const V3f& ref, const V3f&, const V3f& p, const V3f&) const {
  const SphericalTriangle spherical(ref, p0_, p1_, p2_);
  if (spherical.solid_angle > 0) return static_cast<float>(1 / spherical.solid_angle);
  float result;
  return area_to_solid_angle(ref, p, normal(), 1 / area(), &result) ? result : 0;
}

}  // namespace dapple::geom
