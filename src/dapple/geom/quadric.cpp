// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/quadric.h"

namespace dapple::geom {

Quadric::Quadric(QuadricKind kind, const Transform& to_world, bool flip)
    : kind_(kind), to_world_(to_world), flip_(flip != to_world.swaps_handedness()) {}

Quadric Quadric::sphere(const Transform& to_world, float radius, float z0, float z1, float phi_max, bool flip) {
  Quadric q(QuadricKind::sphere, to_world, flip);
  q.radius_ = radius;
  q.z_min_ = std::clamp(std::min(z0, z1), -radius, radius);
  q.z_max_ = std::clamp(std::max(z0, z1), -radius, radius);
  q.theta_min_ = std::acos(std::clamp(q.z_min_ / radius, -1.0f, 1.0f));
  q.theta_max_ = std::acos(std::clamp(q.z_max_ / radius, -1.0f, 1.0f));
  q.phi_max_ = phi_max;
  return q;
}

Quadric Quadric::disk(const Transform& to_world, float height, float radius, float inner, float phi_max, bool flip) {
  Quadric q(QuadricKind::disk, to_world, flip);
  q.radius_ = radius;
  q.inner_radius_ = inner;
  q.z_min_ = q.z_max_ = height;
  q.phi_max_ = phi_max;
  return q;
}

Quadric Quadric::cylinder(const Transform& to_world, float radius, float z0, float z1, float phi_max, bool flip) {
  Quadric q(QuadricKind::cylinder, to_world, flip);
  q.radius_ = radius;
  q.z_min_ = std::min(z0, z1);
  q.z_max_ = std::max(z0, z1);
  q.phi_max_ = phi_max;
  return q;
}

bool Quadric::accept(const V3d& p, float* u, float* v) const {
  double phi = std::atan2(p.y, p.x);
  if (phi < 0) phi += 2 * std::numbers::pi;
  if (phi > phi_max_) return false;
  *u = float(phi / phi_max_);
  switch (kind_) {
    case QuadricKind::sphere: {
      if ((z_min_ > -radius_ && p.z < z_min_) || (z_max_ < radius_ && p.z > z_max_)) return false;
      const double theta = std::acos(std::clamp(p.z / radius_, -1.0, 1.0));
      *v = theta_max_ == theta_min_ ? 0 : float((theta - theta_min_) / (theta_max_ - theta_min_));
      return true;
    }
    case QuadricKind::cylinder:
      if (p.z < z_min_ || p.z > z_max_) return false;
      *v = z_max_ == z_min_ ? 0 : float((p.z - z_min_) / (double(z_max_) - z_min_));
      return true;
    case QuadricKind::disk: {
      const double r = std::sqrt(p.x * p.x + p.y * p.y);
      if (r > radius_ || r < inner_radius_) return false;
      *v = radius_ == inner_radius_ ? 0 : float((radius_ - r) / (double(radius_) - inner_radius_));
      return true;
    }
  }
  return false;
}

bool Quadric::intersect(const V3f& o_world, const V3f& d_world, float t_min, float t_max, float* t_hit, float* u,
                        float* v) const {
  const M44d& m = to_world_.inverse_matrix();
  V3d o, d;
  for (int i = 0; i < 3; ++i) {
    o[i] = m[i][0] * o_world.x + m[i][1] * o_world.y + m[i][2] * o_world.z + m[i][3];
    d[i] = m[i][0] * d_world.x + m[i][1] * d_world.y + m[i][2] * d_world.z;
  }
  const auto try_root = [&](double t) {
    if (!(t > t_min && t < t_max) || !accept(o + d * t, u, v)) return false;
    *t_hit = float(t);
    return true;
  };
  if (kind_ == QuadricKind::disk) return d.z != 0 && try_root((double(z_min_) - o.z) / d.z);

  const bool sphere = kind_ == QuadricKind::sphere;
  const double a = d.x * d.x + d.y * d.y + (sphere ? d.z * d.z : 0);
  if (a == 0) return false;
  // The closest approach to the centre keeps the discriminant accurate far away (Haines et al. 2019).
  const double tc = -(o.x * d.x + o.y * d.y + (sphere ? o.z * d.z : 0)) / a;
  const double px = o.x + tc * d.x, py = o.y + tc * d.y, pz = sphere ? o.z + tc * d.z : 0;
  const double h2 = (double(radius_) * radius_ - (px * px + py * py + pz * pz)) / a;
  if (h2 < 0) return false;
  const double h = std::sqrt(h2);
  return try_root(tc - h) || try_root(tc + h);
}

SurfacePoint Quadric::at(float u, float v) const {
  SurfacePoint s;
  s.u = u;
  s.v = v;
  const float phi = u * phi_max_, c = std::cos(phi), sn = std::sin(phi);
  V3f p, dpdu, dpdv, n, dndu(0, 0, 0), dndv(0, 0, 0);
  switch (kind_) {
    case QuadricKind::sphere: {
      const float range = theta_max_ - theta_min_, theta = theta_min_ + v * range;
      const float st = std::sin(theta), ct = std::cos(theta);
      n = V3f(st * c, st * sn, ct);
      p = n * radius_;
      dpdu = V3f(-phi_max_ * p.y, phi_max_ * p.x, 0);
      dpdv = V3f(ct * c, ct * sn, -st) * (radius_ * range);
      dndu = dpdu * (1 / radius_);
      dndv = dpdv * (1 / radius_);
      break;
    }
    case QuadricKind::cylinder:
      n = V3f(c, sn, 0);
      p = V3f(radius_ * c, radius_ * sn, lerp(v, z_min_, z_max_));
      dpdu = V3f(-phi_max_ * p.y, phi_max_ * p.x, 0);
      dpdv = V3f(0, 0, z_max_ - z_min_);
      dndu = V3f(-phi_max_ * sn, phi_max_ * c, 0);
      break;
    case QuadricKind::disk: {
      const float r = lerp(v, radius_, inner_radius_);
      n = V3f(0, 0, 1);
      p = V3f(r * c, r * sn, z_min_);
      dpdu = V3f(-phi_max_ * p.y, phi_max_ * p.x, 0);
      dpdv = V3f(c, sn, 0) * (inner_radius_ - radius_);
      break;
    }
  }
  s.P = to_world_.point(p);
  s.dPdu = to_world_.vector(dpdu);
  s.dPdv = to_world_.vector(dpdv);
  const float sign = flip_ ? -1.0f : 1.0f;
  const V3f n_world = to_world_.normal(n);
  const float inv = 1 / length(n_world);
  s.Ng = s.Ns = n_world * (inv * sign * (to_world_.swaps_handedness() ? -1.0f : 1.0f));
  s.dNdu = to_world_.normal(dndu) * (inv * sign);
  s.dNdv = to_world_.normal(dndv) * (inv * sign);
  if (length2(s.dPdu) == 0) coordinate_system(s.Ng, &s.dPdu, &s.dPdv);  // poles and centres
  const M44d& m = to_world_.matrix();
  V3f magnitude;
  for (int i = 0; i < 3; ++i)
    magnitude[i] =
        float(std::abs(m[i][0] * p.x) + std::abs(m[i][1] * p.y) + std::abs(m[i][2] * p.z) + std::abs(m[i][3]));
  s.error = position_error(magnitude);
  return s;
}

Box3f Quadric::bounds() const {
  Box3f box;
  const float z0 = kind_ == QuadricKind::disk ? z_min_ : z_min_, z1 = z_max_;
  for (int i = 0; i < 8; ++i)
    box.extendBy(to_world_.point(V3f(i & 1 ? radius_ : -radius_, i & 2 ? radius_ : -radius_, i & 4 ? z1 : z0)));
  // Double-precision hits may lie a rounding outside.
  const float pad = position_error(abs(box.min) + abs(box.max));
  box.min -= V3f(pad);
  box.max += V3f(pad);
  return box;
}

float Quadric::area() const {
  const M44d& m = to_world_.matrix();
  const auto column = [&](int j) { return std::sqrt(m[0][j] * m[0][j] + m[1][j] * m[1][j] + m[2][j] * m[2][j]); };
  const double scale2 = std::pow(column(0) * column(1) * column(2), 2.0 / 3.0);
  double area = 0;
  if (kind_ == QuadricKind::disk)
    area = .5 * phi_max_ * (double(radius_) * radius_ - double(inner_radius_) * inner_radius_);
  else
    area = double(phi_max_) * radius_ * (double(z_max_) - z_min_);
  return float(area * (kind_ == QuadricKind::disk ? column(0) * column(1) : scale2));
}

}  // namespace dapple::geom
