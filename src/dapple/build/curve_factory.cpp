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

}  // namespace

trace::CurvesPtr make_curve(const ShapeEntity& e, const Transform& to_target) {
  const auto& params = e.params;
  const int degree = params.get_int("degree", 3);
  if (degree != 2 && degree != 3) throw InputError(e.loc, "\"degree\" is " + std::to_string(degree) + "; it must be 2 or 3");
  const bool bspline = params.get_choice("basis", {"bezier", "bspline"}, 0) == 1;
  const int type = params.get_choice("type", {"flat", "ribbon", "cylinder"}, 0);
  const auto numbers = params.get_points3("P");
  std::vector<V3f> p(numbers.size() / 3);
  for (size_t i = 0; i < p.size(); ++i) p[i] = V3f(numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]);
  const size_t d = size_t(degree);
  if (p.size() < d + 1 || (!bspline && (p.size() - 1) % d != 0))
    throw InputError(e.loc, "\"P\" has " + std::to_string(p.size()) + " points; a curve of degree " + std::to_string(degree) +
                                " takes " + (bspline ? "at least " : "1 more than a multiple of ") +
                                std::to_string(bspline ? degree + 1 : degree));
  const size_t segments = bspline ? p.size() - d : (p.size() - 1) / d;

  const float width = params.get_float("width", 1);
  const float w0 = params.get_float("width0", width), w1 = params.get_float("width1", width);
  if (w0 < 0 || w1 < 0) throw InputError(e.loc, "a curve's width is negative");
  params.get_int("splitdepth", 3);
  const auto normals = params.get_normals("N");
  if (type == 1 && normals.size() != 3 * (segments + 1))
    throw InputError(e.loc, "a ribbon of " + std::to_string(segments) + " segments takes " + std::to_string(segments + 1) +
                                " normals \"N\", got " + std::to_string(normals.size() / 3));

  auto curves = std::make_shared<geom::CurveSet>();
  curves->kind = type == 0 ? geom::CurveKind::flat : type == 1 ? geom::CurveKind::ribbon : geom::CurveKind::round;
  // Widths scale with the mean stretch of the transform.
  const M44d& m = to_target.matrix();
  const double det = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                     m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  const float stretch = float(std::cbrt(std::abs(det)));
  for (size_t s = 0; s < segments; ++s) {
    V3f c[4];
    segment(p, bspline, degree, s, c);
    const float u0 = float(s) / float(segments), u1 = float(s + 1) / float(segments);
    curves->u_range.push_back(V2f(u0, u1));
    for (int i = 0; i < 4; ++i) {
      const V3f q = to_target.point(c[i]);
      if (!is_finite(q)) throw InputError(e.loc, "a control point is not finite after its transform");
      curves->control_points.push_back({q, 0.5f * stretch * lerp(lerp(float(i) / 3, u0, u1), w0, w1)});
      if (type != 1) continue;
      const auto normal = [&](size_t k) { return V3f(normals[3 * k], normals[3 * k + 1], normals[3 * k + 2]); };
      V3f n = to_target.normal(normal(s) * (1 - float(i) / 3) + normal(s + 1) * (float(i) / 3));
      if (e.reverse_orientation) n = -n;
      curves->normals.push_back(length2(n) > 0 ? normalize(n) : V3f(0, 0, 1));
    }
  }
  return curves;
}

}  // namespace dapple::build
