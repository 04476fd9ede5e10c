// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/curve_factory.h"

namespace dapple::build {

using scenefile::ShapeEntity;

namespace {

// Four cubic Bezier control points of segment i of a curve of any basis and degree.
void segment(const std::vector<V3f>& p, bool bspline, int degree, size_t i, V3f out[4]) {
  if (!bspline) {
    const V3f* c = &p[i * size_t(degree)];
    if (degree == 3) {
      std::copy(c, c + 4, out);
    } else {
      out[0] = c[0];
      out[1] = (c[0] + c[1] * 2) * (1.0f / 3);
      out[2] = (c[1] * 2 + c[2]) * (1.0f / 3);
      out[3] = c[2];
    }
    return;
  }
  const V3f* c = &p[i];
  if (degree == 3) {
    out[1] = (c[1] * 2 + c[2]) * (1.0f / 3);
    out[2] = (c[1] + c[2] * 2) * (1.0f / 3);
    out[0] = ((c[0] + c[1] * 2) * (1.0f / 3) + out[1]) * 0.5f;
    out[3] = (out[2] + (c[2] * 2 + c[3]) * (1.0f / 3)) * 0.5f;
  } else {
    const V3f a = (c[0] + c[1]) * 0.5f, b = (c[1] + c[2]) * 0.5f;
    out[0] = a;
    out[1] = (a + c[1] * 2) * (1.0f / 3);
    out[2] = (c[1] * 2 + b) * (1.0f / 3);
    out[3] = b;
  }
}

// The part [a, b] of a Bezier curve: its polar form at (a, a, a), (a, a, b), (a, b, b), (b, b, b).
void part(const V3f c[4], float a, float b, V3f out[4]) {
  for (int i = 0; i < 4; ++i) {
    const float t[3] = {i < 3 ? a : b, i < 2 ? a : b, i < 1 ? a : b};
    V3f q[4] = {c[0], c[1], c[2], c[3]};
    for (int round = 0; round < 3; ++round)
      for (int k = 0; k < 3 - round; ++k) q[k] = q[k] * (1 - t[round]) + q[k + 1] * t[round];
    out[i] = q[0];
  }
}

V3f tangent(const V3f c[4], float u) {
  const auto at = [&](float t) {
    return (c[1] - c[0]) * (sqr(1 - t)) + (c[2] - c[1]) * (2 * t * (1 - t)) + (c[3] - c[2]) * sqr(t);
  };
  V3f d = at(u);
  if (length2(d) == 0) d = at(lerp(1.0f / 64, u, 0.5f));
  return length2(d) > 0 ? normalize(d) : V3f(0, 0, 0);
}

float angle_between(const V3f& a, const V3f& b) {
  return std::atan2(length(cross(a, b)), dot(a, b));
}

// Along the great circle from a to b, unit vectors.
V3f slerp(const V3f& a, const V3f& b, float t) {
  const float angle = angle_between(a, b), s = std::sin(angle);
  if (s < 1e-4f) return t < 0.5f ? a : b;
  return a * (std::sin((1 - t) * angle) / s) + b * (std::sin(t * angle) / s);
}

// Embree draws a segment of a flat curve as straight pieces. They leave the curve by at most .75 of its second
// differences over the square of their number; a fiftieth of the width cannot be seen, nor what is very small for the
// curve as a whole (hair).
int flat_parts(const V3f c[4], float width, int most) {
  const float bend = std::max(length(c[0] - c[1] * 2 + c[2]), length(c[1] - c[2] * 2 + c[3]));
  const float long_way = length(c[1] - c[0]) + length(c[2] - c[1]) + length(c[3] - c[2]);
  const float tolerance = std::max(0.02f * width, 5e-4f * long_way);
  if (!(tolerance > 0)) return 1;
  return int(
      std::clamp(std::ceil(std::sqrt(0.75f * bend / tolerance) / geom::CurveSet::flat_quads), 1.0f, float(most)));
}

// Embree takes the edges of a segment of a ribbon for cubics with the right ends and tangents: right for what turns
// little.
int ribbon_parts(const V3f c[4], const V3f& n0, const V3f& n1) {
  constexpr int steps = 16;
  float turn = angle_between(n0, n1);
  for (int i = 0; i < steps; ++i) turn += angle_between(tangent(c, float(i) / steps), tangent(c, float(i + 1) / steps));
  return std::clamp(int(std::ceil(turn / (pi / 12))), 1, 64);
}

// Control normals of the part [a, b] of a ribbon, across its tangents; where they are parallel, as a little further
// inside.
void ribbon_normals(const V3f c[4], const V3f& n0, const V3f& n1, const Transform& to_target, float a, float b,
                    V3f out[4]) {
  const auto across = [&](float u) {
    const V3f along = tangent(c, u);
    V3f n(0, 0, 0);
    for (const float inwards : {0.0f, 1.0f / 64, 0.25f}) {
      n = to_target.normal(slerp(n0, n1, lerp(inwards, u, 0.5f)));
      const float size = length(n);
      n -= along * dot(n, along);
      if (length(n) > 1e-3f * size) return normalize(n);
    }
    const V3f aside = cross(along, std::abs(along.x) < 0.5f ? V3f(1, 0, 0) : V3f(0, 1, 0));
    return length2(aside) > 0 ? normalize(aside) : V3f(0, 0, 1);
  };
  const V3f first = across(a), last = across(b);
  for (int i = 0; i < 4; ++i) out[i] = first * (1 - float(i) / 3) + last * (float(i) / 3);
}

}  // namespace

trace::CurvesPtr make_curve(const ShapeEntity& e, const Transform& to_target, bool is_fibre) {
  const auto& params = e.params;
  const int degree = params.get_int("degree", 3);
  if (degree != 2 && degree != 3)
    throw InputError(e.loc, "\"degree\" is " + std::to_string(degree) + "; it must be 2 or 3");
  const bool bspline = params.get_choice("basis", {"bezier", "bspline"}, 0) == 1;
  int type = params.get_choice("type", {"flat", "ribbon", "cylinder"}, 0);
  if (type == 2 && is_fibre) type = 0;
  const auto numbers = params.get_points3("P");
  std::vector<V3f> p(numbers.size() / 3);
  for (size_t i = 0; i < p.size(); ++i) p[i] = V3f(numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]);
  const size_t d = size_t(degree);
  if (p.size() < d + 1 || (!bspline && (p.size() - 1) % d != 0))
    throw InputError(e.loc, "\"P\" has " + std::to_string(p.size()) + " points; a curve of degree " +
                                std::to_string(degree) + " takes " +
                                (bspline ? "at least " : "1 more than a multiple of ") +
                                std::to_string(bspline ? degree + 1 : degree));
  const size_t segments = bspline ? p.size() - d : (p.size() - 1) / d;

  const float width = params.get_float("width", 1);
  const float w0 = params.get_float("width0", width), w1 = params.get_float("width1", width);
  if (w0 < 0 || w1 < 0) throw InputError(e.loc, "a curve's width is negative");
  const int most_parts = 1 << std::clamp(params.get_int("splitdepth", 3), 0, 6);  // of a segment, as in pbrt
  const auto normals = params.get_normals("N");
  if (type == 1 && normals.size() != 3 * (segments + 1))
    throw InputError(e.loc, "a ribbon of " + std::to_string(segments) + " segments takes " +
                                std::to_string(segments + 1) + " normals \"N\", got " +
                                std::to_string(normals.size() / 3));

  auto curves = std::make_shared<geom::CurveSet>();
  curves->kind = type == 0 ? geom::CurveKind::flat : type == 1 ? geom::CurveKind::ribbon : geom::CurveKind::round;
  // Widths scale with the mean stretch of the transform.
  const M44d& m = to_target.matrix();
  const double det = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                     m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                     m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  const float stretch = float(std::cbrt(std::abs(det)));
  for (size_t s = 0; s < segments; ++s) {
    V3f c[4];
    segment(p, bspline, degree, s, c);
    for (V3f& q : c) {
      q = to_target.point(q);
      if (!is_finite(q)) throw InputError(e.loc, "a control point is not finite after its transform");
    }
    const auto normal = [&](size_t k) {
      const V3f n =
          V3f(normals[3 * k], normals[3 * k + 1], normals[3 * k + 2]) * (e.reverse_orientation ? -1.0f : 1.0f);
      return length2(n) > 0 ? normalize(n) : V3f(0, 0, 1);
    };
    const V3f n0 = type == 1 ? normal(s) : V3f(0, 0, 1), n1 = type == 1 ? normal(s + 1) : V3f(0, 0, 1);
    const int parts = type == 0   ? flat_parts(c, stretch * std::max(w0, w1), most_parts)
                      : type == 1 ? ribbon_parts(c, n0, n1)
                                  : 1;
    for (int k = 0; k < parts; ++k) {
      const float a = float(k) / float(parts), b = float(k + 1) / float(parts);
      const float u0 = (float(s) + a) / float(segments), u1 = (float(s) + b) / float(segments);
      V3f control[4] = {c[0], c[1], c[2], c[3]};
      if (parts > 1) part(c, a, b, control);
      curves->u_range.push_back(V2f(u0, u1));
      for (int i = 0; i < 4; ++i)
        curves->control_points.push_back({control[i], 0.5f * stretch * lerp(lerp(float(i) / 3, u0, u1), w0, w1)});
      if (type != 1) continue;
      V3f across[4];
      ribbon_normals(c, n0, n1, to_target, a, b, across);
      curves->normals.insert(curves->normals.end(), across, across + 4);
    }
  }
  return curves;
}

}  // namespace dapple::build
