// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include "dapple/shafts/scan_planes.h"

namespace dapple::test {

struct Triangle {
  V3f p[3];
};

/// What stands on a line o + h d, d unit: the largest h, -infinity without.
using Blocker = std::function<double(const V3f& o, const V3f& d)>;

inline double highest_of(const std::vector<Triangle>& triangles, const V3f& o, const V3f& d) {
  double best = -INFINITY;
  for (const Triangle& t : triangles) {
    const V3d a(t.p[0]), e1 = V3d(t.p[1]) - a, e2 = V3d(t.p[2]) - a, w(d);
    const V3d h = w.cross(e2);
    const double det = e1.dot(h);
    if (det == 0) continue;
    const V3d s = V3d(o) - a;
    const double u = s.dot(h) / det;
    const V3d q = s.cross(e1);
    const double v = w.dot(q) / det;
    if (u >= 0 && v >= 0 && u + v <= 1) best = std::max(best, e2.dot(q) / det);
  }
  return best;
}

/// Fills planes of parallel light as the renderer does: a ray a bin, in its middle, from the light.
inline void fill(shafts::ScanPlanes& planes, const Blocker& highest) {
  for (int k = 0; k < planes.planes(); ++k) {
    for (int j = 0; j < planes.bins(); ++j) {
      const float u = 0.5f * (planes.edge(j) + planes.edge(j + 1));
      if (planes.is_lamp()) {
        const V3f lamp = planes.settings().eye + planes.frame().n * planes.settings().lamp;
        planes.blocked(k)[j] = -float(-highest(lamp, -planes.lamp_direction(k, u)));
      } else {
        planes.blocked(k)[j] = float(highest(planes.foot(k, u), planes.frame().n));
      }
    }
    planes.close(k);
  }
}

/// The lists of Max (1986): where along the ray from the eye along unit d, up to `end`, polygons that the plane through
/// eye and sun cuts shade it. Each triangle gives a piece of a line in the plane; of the ray, that part is dark which
/// lies below it. Counts of +1 and -1 at the ends of the parts tell what is lit. Exact but for rounding.
inline std::vector<std::pair<double, double>> lit_intervals(const std::vector<Triangle>& triangles, const V3f& eye,
                                                            const V3f& axis, const V3f& d, double end) {
  const V3d l(axis), v(d), e(eye);
  const double c = v.dot(l);
  const V3d y = (v - l * c).normalized(), n = l.cross(y);
  const double sine = v.dot(y);
  std::vector<std::pair<double, int>> events;
  for (const Triangle& t : triangles) {
    double cut[2][2];
    int cuts = 0;
    for (int i = 0; i < 3 && cuts < 2; ++i) {
      const V3d a = V3d(t.p[i]) - e, b = V3d(t.p[(i + 1) % 3]) - e;
      const double da = a.dot(n), db = b.dot(n);
      if ((da < 0) == (db < 0)) continue;
      const V3d x = a + (b - a) * (da / (da - db));
      cut[cuts][0] = x.dot(y), cut[cuts++][1] = x.dot(l);
    }
    if (cuts < 2) continue;
    if (cut[0][0] > cut[1][0]) std::swap(cut[0], cut[1]);
    // Over s, the ray's (p, q) = s (sine, c); the piece's q at its p.
    double s0 = std::max(cut[0][0] / sine, 0.0), s1 = std::min(cut[1][0] / sine, end);
    if (!(s1 > s0)) continue;
    const double slope = (cut[1][1] - cut[0][1]) / (cut[1][0] - cut[0][0]);
    const auto above = [&](double s) { return cut[0][1] + slope * (s * sine - cut[0][0]) - s * c; };  // > 0: dark
    const double a0 = above(s0), a1 = above(s1);
    if (a0 <= 0 && a1 <= 0) continue;
    if (a0 < 0) s0 += (s1 - s0) * (a0 / (a0 - a1));
    if (a1 < 0) s1 = s0 + (s1 - s0) * (above(s0) / (above(s0) - a1));
    events.emplace_back(s0, 1);
    events.emplace_back(s1, -1);
  }
  std::sort(events.begin(), events.end());
  std::vector<std::pair<double, double>> lit;
  double from = 0;
  int dark = 0;
  for (const auto& [s, step] : events) {
    if (dark == 0 && s > from) lit.emplace_back(from, s);
    dark += step;
    from = s;
  }
  if (dark == 0 && end > from) lit.emplace_back(from, end);
  return lit;
}

}  // namespace dapple::test
