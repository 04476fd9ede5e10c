// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/triangle_emitter.h"

#include <utility>

#include "dapple/geom/sample_lanes.h"
#include "dapple/numeric/branchless.h"
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
    const double omega = 2 * argument(1 + a.dot(b) + b.dot(c) + c.dot(a), det);
    if (omega >= TriangleEmitter::min_solid_angle && omega <= TriangleEmitter::max_solid_angle) solid_angle = omega;
  }

  /// True where the triangle is so small or far that points uniform in area are as good: they cost a sixth.
  static bool is_small(const V3f& ref, const V3f& p0, const V3f& p1, const V3f& p2) {
    const V3f centre = (p0 + p1 + p2) * (1.0f / 3);
    const float r2 = std::max({length2(p0 - centre), length2(p1 - centre), length2(p2 - centre)});
    return r2 < sqr(TriangleEmitter::small_angle) * length2(centre - ref);
  }
};

/// Directions uniform in the triangle (Arvo 1995): u.x cuts off a sub-triangle a, b, c2; u.y walks from b towards c2.
struct ArvoSampling {
  const SphericalTriangle& t;
  double cos_c, cos_alpha, sin_alpha;
  V3d along;       // from a to c, at a right angle to a
  V3d bc, ca, ab;  // crosses of vertices

  explicit ArvoSampling(const SphericalTriangle& triangle) : t(triangle), cos_c(t.a.dot(t.b)) {
    const double cos_b = t.a.dot(t.c), num = t.b.dot(t.c) - cos_c * cos_b, hyp = std::sqrt(num * num + t.det * t.det);
    cos_alpha = num / hyp, sin_alpha = t.det / hyp;
    along = (t.c - t.a * cos_b).normalized();
    bc = t.B.cross(t.C), ca = t.C.cross(t.A), ab = t.A.cross(t.B);
  }

  V3d direction(double u, double v) const {
    const auto [sin_area, cos_area] = sine_cosine(u * t.solid_angle);
    const double sine = sin_area * cos_alpha - cos_area * sin_alpha,
                 cosine = cos_area * cos_alpha + sin_area * sin_alpha;
    const double x = cosine - cos_alpha, y = sine + sin_alpha * cos_c;
    const double q0 = ((y * cosine - x * sine) * cos_alpha - y) / ((y * sine + x * cosine) * sin_alpha);
    const double q = q0 <= 1 ? std::max(q0, -1.0) : 1;  // also for the 0/0 of u = 0
    const V3d c2 = t.a * q + along * std::sqrt(1 - q * q);
    const double cos_c2 = c2.dot(t.b), h = v * (1 - cos_c2);
    const V3d across = c2 - t.b * cos_c2;
    return t.b * (1 - h) + across * std::sqrt(h * (2 - h) / std::max(across.dot(across), 1e-300));
  }

  /// Barycentric coordinates of the points in those directions; NaN where rounding leaves none.
  void points(std::span<const V2f> u, V3f* out) const {
    const SampleLanes lanes(u);
    alignas(64) double b[3][most_at_once];
    lanes.each([&](int i) {
      const V3d w = direction(lanes.x[i], lanes.y[i]);
      const double b0 = std::abs(w.dot(bc)), b1 = std::abs(w.dot(ca)), b2 = std::abs(w.dot(ab)),
                   share = 1 / (b0 + b1 + b2);
      b[0][i] = b0 * share, b[1][i] = b1 * share, b[2][i] = b2 * share;
    });
    for (size_t i = 0; i < u.size(); ++i) out[i] = {float(b[0][i]), float(b[1][i]), float(b[2][i])};
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
  V3f barycentric[most_at_once];
  if (by_angle)
    ArvoSampling(spherical).points(u, barycentric);
  else
    for (size_t i = 0; i < u.size(); ++i) {
      const V2f b = square_to_triangle(u[i]);
      barycentric[i] = {b.x, b.y, 1 - b.x - b.y};
    }
  uint32_t drawn = 0;
  for (size_t i = 0; i < u.size(); ++i) {
    const V3f b = barycentric[i];
    if (!(b.x >= 0)) continue;
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
