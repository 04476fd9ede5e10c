// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/patch_emitter.h"

#include <numbers>

namespace dapple::geom {
namespace {

V3d to_double(const V3f& v) { return V3d(v.x, v.y, v.z); }

/// Solid-angle sampling of a rectangle, in the notation of Urena et al. 2013, section 3. Angles are by atan2, which keeps the solid
/// angle right at grazing views, where the cosines of the paper round to one.
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

/// x in [0, 1) with density proportional to (1-x) a + x b.
float sample_linear(float u, float a, float b) {
  if (!(a + b > 0)) return u;
  return std::min(u * (a + b) / (a + std::sqrt(lerp(u, a * a, b * b))), one_minus_epsilon);
}

}  // namespace

PatchEmitter::PatchEmitter(const V3f& p00, const V3f& p10, const V3f& p01, const V3f& p11, bool flip,
                           const std::optional<UV>& uv)
    : p00_(p00), p10_(p10), p01_(p01), p11_(p11), flip_(flip), uv_(uv ? std::make_unique<const UV>(*uv) : nullptr) {
  const std::array<V3f, 4> n = {cross_derivatives({0, 0}), cross_derivatives({1, 0}), cross_derivatives({0, 1}),
                                cross_derivatives({1, 1})};
  float largest = 0;
  for (int i = 0; i < 4; ++i) stretch_[i] = length(n[i]), largest = std::max(largest, stretch_[i]);
  // Planar and convex: all corner normals are the same way.
  const V3f mean = n[0] + n[1] + n[2] + n[3];
  bool planar = true;
  for (int i = 0; i < 4; ++i)
    planar &= length(n[i] - mean * (dot(n[i], mean) / length2(mean))) <= 1e-5f * largest && dot(n[i], mean) >= 0;
  const V3f ex = p10 - p00, ey = p01 - p00;
  const float size = std::max(length(ex), length(ey));
  const bool parallelogram = length(p11 - p10 - ey) <= 1e-5f * size;
  const bool rectangle = parallelogram && std::abs(dot(ex, ey)) <= 1e-5f * length(ex) * length(ey);
  kind_ = rectangle ? Kind::rectangle : planar ? Kind::planar : Kind::curved;
  if (planar) {
    area_ = length(mean) / 4;
    return;
  }
  constexpr int steps = 64;  // midpoint rule: error O(steps^-2) of the curvature
  double sum = 0;
  for (int i = 0; i < steps; ++i)
    for (int j = 0; j < steps; ++j) sum += length(cross_derivatives({(i + 0.5f) / steps, (j + 0.5f) / steps}));
  area_ = static_cast<float>(sum / (steps * steps));
}

V3f PatchEmitter::point(const V2f& st) const {
  return (p00_ * (1 - st.x) + p10_ * st.x) * (1 - st.y) + (p01_ * (1 - st.x) + p11_ * st.x) * st.y;
}

V3f PatchEmitter::cross_derivatives(const V2f& st) const {
  const V3f du = (p10_ - p00_) * (1 - st.y) + (p11_ - p01_) * st.y;
  const V3f dv = (p01_ - p00_) * (1 - st.x) + (p11_ - p10_) * st.x;
  return flip_ ? cross(dv, du) : cross(du, dv);
}

float PatchEmitter::density(const V2f& st) const {
  const auto& s = stretch_;
  const float sum = s[0] + s[1] + s[2] + s[3];
  return 4 * lerp(st.y, lerp(st.x, s[0], s[1]), lerp(st.x, s[2], s[3])) / sum;
}

V2f PatchEmitter::uv_at(const V2f& st) const {
  if (!uv_) return st;
  const UV& uv = *uv_;
  return (uv[0] * (1 - st.x) + uv[1] * st.x) * (1 - st.y) + (uv[2] * (1 - st.x) + uv[3] * st.x) * st.y;
}

Box3f PatchEmitter::bounds() const {
  Box3f box(p00_);
  box.extendBy(p10_);
  box.extendBy(p01_);
  box.extendBy(p11_);
  return box;
}

NormalCone PatchEmitter::normal_cone() const {
  // dp/du x dp/dv is bilinear in its corner values, so every convex cone around those holds all normals.
  V3f axis(0, 0, 0);
  const std::array<V2f, 4> corners = {V2f(0, 0), V2f(1, 0), V2f(0, 1), V2f(1, 1)};
  for (const V2f& st : corners) {
    const V3f n = cross_derivatives(st);
    if (length2(n) > 0) axis += normalize(n);
  }
  if (!(length2(axis) > 0)) return {};
  axis = normalize(axis);
  if (is_planar()) return {axis, 1};
  float cos_theta = 1;
  for (const V2f& st : corners) {
    const V3f n = cross_derivatives(st);
    if (length2(n) > 0) cos_theta = std::min(cos_theta, dot(axis, normalize(n)));
  }
  return cos_theta > 0 ? NormalCone{axis, cos_theta} : NormalCone{};
}

V2f PatchEmitter::invert(const V3f& p) const {
  // q = u e + v f + u v g  =>  (q - u e) x (f + u g) = 0: a quadratic in u along any direction; the patch's mean normal is used.
  const V3d e = to_double(p10_ - p00_), f = to_double(p01_ - p00_), g = to_double(p11_) - to_double(p10_ + p01_) + to_double(p00_);
  const V3d q = to_double(p) - to_double(p00_);
  const V3d n = (e + 0.5 * g).cross(f + 0.5 * g);
  const double a = -n.dot(e.cross(g)), b = n.dot(q.cross(g) - e.cross(f)), c = n.dot(q.cross(f));
  const double root = std::sqrt(std::max(b * b - 4 * a * c, 0.0));
  const double half = -0.5 * (b + std::copysign(root, b));
  const std::array<double, 2> candidates = {a != 0 ? half / a : 0.0, half != 0 ? c / half : 0.0};
  V2f best(0, 0);
  double best_error = std::numeric_limits<double>::infinity();
  for (double u : candidates) {
    if (!std::isfinite(u)) continue;
    u = std::clamp(u, 0.0, 1.0);
    const V3d line = f + u * g;
    const double l2 = line.dot(line);
    const double v = l2 > 0 ? std::clamp((q - u * e).dot(line) / l2, 0.0, 1.0) : 0.0;
    const double error = (q - u * e - v * line).length2();
    if (error < best_error) best_error = error, best = {static_cast<float>(u), static_cast<float>(v)};
  }
  return best;
}

bool PatchEmitter::sample(const V3f& ref, const V2f& u, EmitterSample* out) const {
  V2f st;
  double solid_angle = 0;
  if (kind_ == Kind::rectangle) {
    const SphericalRectangle spherical(ref, p00_, p10_ - p00_, p01_ - p00_);
    solid_angle = spherical.solid_angle;
    st = solid_angle >= min_solid_angle ? spherical.sample(u) : u;
  } else {
    st.y = sample_linear(u.y, stretch_[0] + stretch_[1], stretch_[2] + stretch_[3]);
    st.x = sample_linear(u.x, lerp(st.y, stretch_[0], stretch_[2]), lerp(st.y, stretch_[1], stretch_[3]));
  }
  const V3f n = cross_derivatives(st);
  const float stretch = length(n);
  if (!(stretch > 0)) return false;
  out->p = point(st);
  out->n = n * (1 / stretch);
  out->uv = uv_at(st);
  if (solid_angle >= min_solid_angle) {
    out->pdf = static_cast<float>(1 / solid_angle);
    return true;
  }
  const float pdf_area = is_planar() ? 1 / area_ : density(st) / stretch;
  return area_to_solid_angle(ref, out->p, out->n, pdf_area, &out->pdf);
}

float PatchEmitter::pdf(const V3f& ref, const V3f&, const V3f& p, const V3f&) const {
  if (kind_ == Kind::rectangle) {
    const double solid_angle = SphericalRectangle(ref, p00_, p10_ - p00_, p01_ - p00_).solid_angle;
    if (solid_angle >= min_solid_angle) return static_cast<float>(1 / solid_angle);
  }
  const V2f st = is_planar() ? V2f(0.5f, 0.5f) : invert(p);
  const V3f n = cross_derivatives(st);
  const float stretch = length(n);
  const float pdf_area = is_planar() ? 1 / area_ : density(st) / stretch;
  float result;
  return area_to_solid_angle(ref, p, n * (1 / stretch), pdf_area, &result) ? result : 0;
}

}  // namespace dapple::geom
