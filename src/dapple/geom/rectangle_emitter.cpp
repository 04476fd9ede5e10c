// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/rectangle_emitter.h"

#include <algorithm>
#include <numbers>

#include "dapple/geom/sample_lanes.h"
#include "dapple/numeric/branchless.h"

namespace dapple::geom {
namespace {

V3d to_double(const V3f& v) {
  return V3d(v.x, v.y, v.z);
}

// A complex number that is only asked for its argument.
struct Argument {
  double re, im;
  Argument operator*(const Argument& o) const { return {re * o.re - im * o.im, re * o.im + im * o.re}; }
  double positive() const { return argument(re, im); }
};

}  // namespace

/// Solid-angle sampling of a rectangle, in the notation of Urena et al. 2013, section 3. The inner angles g0 .. g3 of
/// the spherical rectangle are arguments of complex numbers, so that sums of them cost one arctangent, and the solid
/// angle stays right at grazing views, where the cosines of the paper round to one.
struct RectangleEmitter::Spherical {
  double x0, x1, y0, y1, z0;
  Argument g01, g23;

  Spherical(const V3f& ref, const RectangleEmitter& r) {
    const V3d d = to_double(r.corner_) - to_double(ref);
    x0 = d.dot(r.x_), y0 = d.dot(r.y_), z0 = -std::abs(d.dot(r.z_));
    x1 = x0 + r.width_, y1 = y0 + r.height_;
    const auto angle = [this](double px, double py, double sign) {
      return Argument{sign * px * py, -z0 * std::sqrt(px * px + py * py + z0 * z0)};
    };
    g01 = angle(x1, y0, 1) * angle(x1, y1, -1);
    g23 = angle(x0, y1, 1) * angle(x0, y0, -1);
  }

  /// g0 + g1 + g2 + g3 - 2 pi; above a half-space of directions there is none.
  double solid_angle() const {
    if (!(z0 < 0)) return 0;
    const double sum = (g01 * g23).positive();
    return sum > 2 * std::numbers::pi - 1e-9 ? 0 : sum;  // rounding below zero
  }

  /// Where in the rectangle, each in [0, 1]. With the paper's f_u = N / sin, x_u is -z0 / sqrt(f_u^2 - z0^2 / (y0^2 +
  /// z0^2)), of f_u's sign.
  void sample(std::span<const V2f> u, double solid_angle, V2f* st) const {
    const double to_y0 = y0 * y0 + z0 * z0, b0 = -y0 / std::sqrt(to_y0), b1 = y1 / std::sqrt(y1 * y1 + z0 * z0),
                 c0 = z0 * z0 / to_y0;
    const double first = 2 * std::numbers::pi - g23.positive(), per_x = 1 / (x1 - x0), per_y = 1 / (y1 - y0);
    const SampleLanes lanes(u);
    alignas(64) double s[most_at_once], t[most_at_once];
    lanes.each([&](int i) {
      const auto [sine, cosine] = sine_cosine(lanes.x[i] * solid_angle + first);
      const double numerator = cosine * b0 - b1;
      const double across = -z0 / std::sqrt(std::max(numerator * numerator - c0 * sine * sine, 1e-300));
      const double xu = std::clamp(across * std::copysign(1.0, numerator) * sine, x0, x1);
      const double d2 = xu * xu + z0 * z0;
      const double h0 = y0 / std::sqrt(d2 + y0 * y0), h1 = y1 / std::sqrt(d2 + y1 * y1);
      const double hv = h0 + lanes.y[i] * (h1 - h0);
      const double yv = std::clamp(hv * std::sqrt(d2 / std::max(1 - hv * hv, 1e-12)), y0, y1);
      s[i] = (xu - x0) * per_x;
      t[i] = (yv - y0) * per_y;
    });
    for (size_t i = 0; i < u.size(); ++i) st[i] = {static_cast<float>(s[i]), static_cast<float>(t[i])};
  }
};

bool RectangleEmitter::is_rectangle(const V3f c[4]) {
  const V3f ex = c[1] - c[0], ey = c[3] - c[0];
  const float lx = length(ex), ly = length(ey);
  return length(c[2] - c[1] - ey) <= 1e-5f * std::max(lx, ly) && std::abs(dot(ex, ey)) <= 1e-5f * lx * ly;
}

RectangleEmitter::RectangleEmitter(const V3f c[4], bool flip, const std::optional<UV>& uv)
    : corner_(c[0]),
      ex_(c[1] - c[0]),
      ey_(c[3] - c[0]),
      width_(to_double(ex_).length()),
      height_(to_double(ey_).length()),
      x_(to_double(ex_) / width_),
      y_(to_double(ey_) / height_),
      z_(x_.cross(y_)),
      normal_(flip ? -z_ : z_),
      uv_(uv ? std::make_unique<const UV>(*uv) : nullptr) {}

Box3f RectangleEmitter::bounds() const {
  Box3f box(corner_);
  box.extendBy(corner_ + ex_);
  box.extendBy(corner_ + ey_);
  box.extendBy(corner_ + ex_ + ey_);
  return box;
}

V2f RectangleEmitter::uv_at(const V2f& st) const {
  if (!uv_) return st;
  const UV& uv = *uv_;
  return (uv[0] * (1 - st.x) + uv[1] * st.x) * (1 - st.y) + (uv[3] * (1 - st.x) + uv[2] * st.x) * st.y;
}

uint32_t RectangleEmitter::sample(const V3f& ref, std::span<const V2f> u, EmitterSample* out) const {
  const Spherical spherical(ref, *this);
  const double solid_angle = spherical.solid_angle();
  const bool by_angle = solid_angle >= min_solid_angle;
  V2f st[most_at_once];
  if (by_angle)
    spherical.sample(u, solid_angle, st);
  else
    std::copy(u.begin(), u.end(), st);
  uint32_t drawn = 0;
  for (size_t i = 0; i < u.size(); ++i) {
    out[i].p = corner_ + ex_ * st[i].x + ey_ * st[i].y;
    out[i].n = normal();
    out[i].uv = uv_at(st[i]);
    out[i].pdf = static_cast<float>(1 / solid_angle);
    if (by_angle || area_to_solid_angle(ref, out[i].p, out[i].n, 1 / area(), &out[i].pdf)) drawn |= 1u << i;
  }
  return drawn;
}

float RectangleEmitter::pdf(const V3f& ref, const V3f&, const V3f& p, const V3f&) const {
  const double solid_angle = Spherical(ref, *this).solid_angle();
  if (solid_angle >= min_solid_angle) return static_cast<float>(1 / solid_angle);
  float result;
  return area_to_solid_angle(ref, p, normal(), 1 / area(), &result) ? result : 0;
}

}  // namespace dapple::geom
