// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/cylinder_emitter.h"

namespace dapple::geom {

CylinderEmitter::CylinderEmitter(const Transform& object_to_world, float radius, float z_min, float z_max,
                                 float phi_max, bool flip)
    : map_(object_to_world),
      radius_(std::abs(radius)),
      z_min_(std::min(z_min, z_max)),
      z_max_(std::max(z_min, z_max)),
      phi_max_(std::clamp(phi_max, 0.0f, 2 * pi)),
      flip_(flip),
      outwards_only_(!flip && phi_max_ >= 2 * pi * (1 - 1e-6f)) {
  object_area_ = phi_max_ * radius_ * (z_max_ - z_min_);
  constexpr int steps = 1024;
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    const float phi = phi_max_ * (i + 0.5f) / steps;
    sum += length(map_.area_vector({std::cos(phi), std::sin(phi), 0}));
  }
  area_ = object_area_ * static_cast<float>(sum / steps);
}

Box3f CylinderEmitter::bounds() const {
  const V3f half =
      V3f(std::hypot(map_.x.x, map_.y.x), std::hypot(map_.x.y, map_.y.y), std::hypot(map_.x.z, map_.y.z)) * radius_;
  Box3f box;
  for (const float z : {z_min_, z_max_}) {
    const V3f centre = map_.point({0, 0, z});
    box.extendBy(centre - half);
    box.extendBy(centre + half);
  }
  return box;
}

/// What a reference point sees of it.
struct CylinderEmitter::View {
  View(const CylinderEmitter& c, const V3f& ref) {
    const V3f local = c.map_.to_local(ref);
    d = std::hypot(local.x, local.y);
    sees_outside = c.outwards_only_ && d > c.radius_ * 1.0001f && d < infinity;
    if (!sees_outside) return;
    toward = V2f(local.x / d, local.y / d);
    const V3f from_origin = ref - c.map_.origin;
    const float scale2 = length2(c.map_.z);
    foot = dot(from_origin, c.map_.z) / scale2;
    height = length(from_origin - c.map_.z * foot) / std::sqrt(scale2);
    // From afar angles cannot be told apart, and differ as places do.
    by_angle = height > 0 && height < 64 * (c.z_max_ - c.z_min_);
    if (!by_angle) return;
    first = std::atan((c.z_min_ - foot) / height);
    last = std::atan((c.z_max_ - foot) / height);
  }

  float d;  ///< from the axis, object space
  bool sees_outside, by_angle = false;
  V2f toward{1, 0};    ///< from the axis to the point, object space, unit
  float foot, height;  ///< its foot on the axis and its world distance from there, both in units of object space's z
  float first, last;   ///< angles at the point, from the foot to the ends of the axis
};

// Density over world area where the object's normal is n.
float CylinderEmitter::area_pdf(const View& view, const V3f& n, float z) const {
  const float stretch = length(map_.area_vector(n));
  if (!view.sees_outside) return 1 / (object_area_ * stretch);
  // Seen from a distance d, the place at phi from there is at alpha = atan2(r sin phi, d - r cos phi) from the axis.
  const float r = radius_, d = view.d, cos_phi = n.x * view.toward.x + n.y * view.toward.y;
  const float d_alpha = r * (d * cos_phi - r) / (d * d + r * r - 2 * d * r * cos_phi);
  if (!(d_alpha > 0)) return 0;
  const float by_phi = d_alpha / (2 * std::asin(std::min(r / d, 1.0f)));
  const float by_z = view.by_angle ? view.height / ((sqr(view.height) + sqr(z - view.foot)) * (view.last - view.first))
                                   : 1 / (z_max_ - z_min_);
  return by_phi * by_z / (r * stretch);
}

bool CylinderEmitter::sample(const V3f& ref, const V2f& u, EmitterSample* out) const {
  const View view(*this, ref);
  V3f n(0, 0, 0);
  float z = lerp(u.y, z_min_, z_max_);
  if (view.sees_outside) {
    const float sin_max = radius_ / view.d, alpha = std::asin(std::min(sin_max, 1.0f)) * (2 * u.x - 1);
    const float phi = std::asin(std::clamp(std::sin(alpha) / sin_max, -1.0f, 1.0f)) - alpha;
    const float c = std::cos(phi), s = std::sin(phi);
    n = V3f(view.toward.x * c - view.toward.y * s, view.toward.y * c + view.toward.x * s, 0);
    if (view.by_angle)
      z = std::clamp(view.foot + view.height * std::tan(lerp(u.y, view.first, view.last)), z_min_, z_max_);
  } else {
    n = V3f(std::cos(phi_max_ * u.x), std::sin(phi_max_ * u.x), 0);
  }
  const V3f area_vector = map_.area_vector(n);
  out->p = map_.point({n.x * radius_, n.y * radius_, z});
  out->n = normalize(flip_ ? -area_vector : area_vector);
  float phi = std::atan2(n.y, n.x);
  if (phi < 0) phi += 2 * pi;
  out->uv = {view.sees_outside ? phi / phi_max_ : u.x, (z - z_min_) / (z_max_ - z_min_)};
  return area_to_solid_angle(ref, out->p, out->n, area_pdf(view, n, z), &out->pdf);
}

float CylinderEmitter::pdf(const V3f& ref, const V3f&, const V3f& p, const V3f&) const {
  const V3f local = map_.to_local(p);
  const V3f n = normalize(V3f(local.x, local.y, 0));
  float result;
  return area_to_solid_angle(ref, p, normalize(map_.area_vector(n)), area_pdf(View(*this, ref), n, local.z), &result)
             ? result
             : 0;
}

}  // namespace dapple::geom
