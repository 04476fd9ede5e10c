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
      flip_(flip) {
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

bool CylinderEmitter::sample(const V3f& ref, const V2f& u, EmitterSample* out) const {
  const float phi = phi_max_ * u.x;
  const V3f n(std::cos(phi), std::sin(phi), 0);
  const V3f area_vector = map_.area_vector(n);
  out->p = map_.point({n.x * radius_, n.y * radius_, lerp(u.y, z_min_, z_max_)});
  out->n = normalize(flip_ ? -area_vector : area_vector);
  out->uv = u;
  return area_to_solid_angle(ref, out->p, out->n, 1 / (object_area_ * length(area_vector)), &out->pdf);
}

float CylinderEmitter::pdf(const V3f& ref, const V3f&, const V3f& p, const V3f&) const {
  V3f n = map_.to_local(p);
  n.z = 0;
  const V3f area_vector = map_.area_vector(normalize(n));
  float result;
  const float pdf_area = 1 / (object_area_ * length(area_vector));
  return area_to_solid_angle(ref, p, normalize(area_vector), pdf_area, &result) ? result : 0;
}

}  // namespace dapple::geom
