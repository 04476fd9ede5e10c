// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/rectangle_emitter.h"

#include <numbers>

namespace dapple::geom {
namespace {

V3d to_double(const V3f& v) {
  return V3d(v.x, v.y, v.z);
}

/// Solid-angle sampling of a rectangle, in the notation of Urena et al. 2013, section 3. Angles are by atan2, which
/// keeps the solid angle right at grazing views, where the cosines of the paper round to one.
struct SphericalRectangle {
  V3d o, x, y, z;
  double x0, x1, y0, y1, z0, b0, b1, k, solid_angle;

  SphericalRectangle(const V3f& ref, const V3f& corner, const V3f& ex, const V3f& ey) : o(to_double(ref)) {
    const double width = to_double(ex).length(), height = to_double(ey).length();
    x = to_double(ex) / width;
    y = to_double(ey) / height;
    z = x.cross(y);
    const V3d d = to_double(corner) - o;
    z0 = d.dot(z);
    if (z0 > 0) z = -z, z0 = -z0;
    x0 = d.dot(x), y0 = d.dot(y);
    x1 = x0 + width, y1 = y0 + height;
    const auto angle = [this](double px, double py, double sign) {
      return std::atan2(-z0 * std::sqrt(px * px + py * py + z0 * z0), sign * px * py);
    };
    const double g0 = angle(x1, y0, 1), g1 = angle(x1, y1, -1), g2 = angle(x0, y1, 1), g3 = angle(x0, y0, -1);
    b0 = -y0 / std::hypot(y0, z0);
    b1 = y1 / std::hypot(y1, z0);
    k = 2 * std::numbers::pi - g2 - g3;
    solid_angle = z0 < 0 ? g0 + g1 - k : 0;
  }

  /// Where in the rectangle, each in [0, 1].
  V2f sample(const V2f& u) const {
    const double au = u.x * solid_angle + k;
    const double fu = (std::cos(au) * b0 - b1) / std::sin(au);
    const double cu = std::clamp(std::copysign(1 / std::sqrt(fu * fu + b0 * b0), fu), -1.0, 1.0);
    const double xu = std::clamp(-(cu * z0) / std::sqrt(std::max(1 - cu * cu, 1e-30)), x0, x1);
    const double d = std::hypot(xu, z0);
    const double h0 = y0 / std::hypot(d, y0), h1 = y1 / std::hypot(d, y1);
    const double hv = h0 + u.y * (h1 - h0), hv2 = hv * hv;
    const double yv = hv2 < 1 - 1e-12 ? std::clamp(hv * d / std::sqrt(1 - hv2), y0, y1) : (hv > 0 ? y1 : y0);
    return {static_cast<float>((xu - x0) / (x1 - x0)), static_cast<float>((yv - y0) / (y1 - y0))};
  }
};

}  // namespace

bool RectangleEmitter::is_rectangle(const V3f c[4]) {
  const V3f ex = c[1] - c[0], ey = c[3] - c[0];
  const float lx = length(ex), ly = length(ey);
  return length(c[2] - c[1] - ey) <= 1e-5f * std::max(lx, ly) && std::abs(dot(ex, ey)) <= 1e-5f * lx * ly;
}

RectangleEmitter::RectangleEmitter(const V3f c[4], bool flip, const std::optional<UV>& uv)
    : corner_(c[0]),
      ex_(c[1] - c[0]),
      ey_(c[3] - c[0]),
      flip_(flip),
      uv_(uv ? std::make_unique<const UV>(*uv) : nullptr) {}

float RectangleEmitter::area() const {
  return length(cross(ex_, ey_));
}

V3f RectangleEmitter::normal() const {
  const V3f n = normalize(cross(ex_, ey_));
  return flip_ ? -n : n;
}

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

bool RectangleEmitter::sample(const V3f& ref, const V2f& u, EmitterSample* out) const {
  const SphericalRectangle spherical(ref, corner_, ex_, ey_);
  const bool by_angle = spherical.solid_angle >= min_solid_angle;
  const V2f st = by_angle ? spherical.sample(u) : u;
  out->p = corner_ + ex_ * st.x + ey_ * st.y;
  out->n = normal();
  out->uv = uv_at(st);
  if (!by_angle) return area_to_solid_angle(ref, out->p, out->n, 1 / area(), &out->pdf);
  out->pdf = static_cast<float>(1 / spherical.solid_angle);
  return true;
}

float RectangleEmitter::pdf(const V3f& ref, const V3f&, const V3f& p, const V3f&) const {
  const double solid_angle = SphericalRectangle(ref, corner_, ex_, ey_).solid_angle;
  if (solid_angle >= min_solid_angle) return static_cast<float>(1 / solid_angle);
  float result;
  return area_to_solid_angle(ref, p, normal(), 1 / area(), &result) ? result : 0;
}

}  // namespace dapple::geom
