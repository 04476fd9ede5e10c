// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/disk_emitter.h"

#include "dapple/numeric/warp.h"

namespace dapple::geom {

DiskEmitter::DiskEmitter(const Transform& object_to_world, float height, float radius, float inner_radius,
                         float phi_max, bool flip)
    : map_(object_to_world),
      height_(height),
      radius_(std::abs(radius)),
      inner_radius_(std::clamp(inner_radius, 0.0f, radius_)),
      phi_max_(std::clamp(phi_max, 0.0f, 2 * pi)) {
  const V3f area_vector = map_.area_vector({0, 0, 1});
  n_ = normalize(flip ? -area_vector : area_vector);
  area_ = 0.5f * phi_max_ * (radius_ * radius_ - inner_radius_ * inner_radius_) * length(area_vector);
}

Box3f DiskEmitter::bounds() const {
  const V3f centre = map_.point({0, 0, height_});
  const V3f half =
      V3f(std::hypot(map_.x.x, map_.y.x), std::hypot(map_.x.y, map_.y.y), std::hypot(map_.x.z, map_.y.z)) * radius_;
  return Box3f(centre - half, centre + half);
}

bool DiskEmitter::sample(const V3f& ref, const V2f& u, EmitterSample* out) const {
  V3f local(0, 0, height_);
  float r, phi;
  if (inner_radius_ == 0 && phi_max_ >= 2 * pi) {
    const V2f d = square_to_disk(u) * radius_;
    local.x = d.x, local.y = d.y;
    r = std::hypot(d.x, d.y);
    phi = std::atan2(d.y, d.x);
    if (phi < 0) phi += 2 * pi;
  } else {
    r = std::sqrt(lerp(u.x, inner_radius_ * inner_radius_, radius_ * radius_));
    phi = phi_max_ * u.y;
    local.x = r * std::cos(phi), local.y = r * std::sin(phi);
  }
  out->p = map_.point(local);
  out->n = n_;
  out->uv = {phi / phi_max_, (radius_ - r) / (radius_ - inner_radius_)};
  return area_to_solid_angle(ref, out->p, n_, 1 / area_, &out->pdf);
}

float DiskEmitter::pdf(const V3f& ref, const V3f&, const V3f& p, const V3f&) const {
  float result;
  return area_to_solid_angle(ref, p, n_, 1 / area_, &result) ? result : 0;
}

}  // namespace dapple::geom
