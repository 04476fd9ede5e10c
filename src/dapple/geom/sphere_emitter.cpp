// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/sphere_emitter.h"

#include "dapple/numeric/warp.h"

namespace dapple::geom {

SphereEmitter::SphereEmitter(const Transform& object_to_world, float radius, float z_min, float z_max, float phi_max,
                             bool flip)
    : map_(object_to_world),
      radius_(std::abs(radius)),
      z_min_(std::clamp(std::min(z_min, z_max), -radius_, radius_)),
      z_max_(std::clamp(std::max(z_min, z_max), -radius_, radius_)),
      phi_max_(std::clamp(phi_max, 0.0f, 2 * pi)),
      flip_(flip) {
  const bool whole = z_min_ <= -radius_ && z_max_ >= radius_ && phi_max_ >= 2 * pi * (1 - 1e-6f);
  const float scale = map_.uniform_scale();
  world_radius_ = whole ? radius_ * scale : 0;
  object_area_ = phi_max_ * radius_ * (z_max_ - z_min_);
  if (scale > 0) {
    area_ = object_area_ * scale * scale;
    return;
  }
  constexpr int steps = 128;
  double sum = 0;
  for (int i = 0; i < steps; ++i)
    for (int j = 0; j < steps; ++j) {
      const float z = lerp((i + 0.5f) / steps, z_min_, z_max_) / radius_, phi = phi_max_ * (j + 0.5f) / steps;
      sum += length(map_.area_vector(spherical_direction(safe_sqrt(1 - z * z), z, phi)));
    }
  area_ = object_area_ * static_cast<float>(sum / (steps * steps));
}

Box3f SphereEmitter::bounds() const {
  // Extent of the ellipsoid along each world axis; a partial sphere gets the same box.
  const V3f half = V3f(std::hypot(map_.x.x, map_.y.x, map_.z.x), std::hypot(map_.x.y, map_.y.y, map_.z.y),
                       std::hypot(map_.x.z, map_.y.z, map_.z.z)) *
                   radius_;
  return Box3f(map_.origin - half, map_.origin + half);
}

V2f SphereEmitter::uv_at(const V3f& n) const {
  float phi = std::atan2(n.y, n.x);
  if (phi < 0) phi += 2 * pi;
  const auto theta = [this](float z) { return std::acos(std::clamp(z / radius_, -1.0f, 1.0f)); };
  const float first = theta(z_min_), last = theta(z_max_);
  return {phi / phi_max_, (std::acos(std::clamp(n.z, -1.0f, 1.0f)) - first) / (last - first)};
}

bool SphereEmitter::sees_cone(const V3f& ref, float* sin2_max, float* distance) const {
  if (!(world_radius_ > 0)) return false;
  const float d2 = length2(ref - map_.origin), r2 = world_radius_ * world_radius_;
  *sin2_max = r2 / d2;
  *distance = std::sqrt(d2);
  return d2 > r2 * 1.0001f;
}

bool SphereEmitter::sample_cone(const V3f& ref, const V2f& u, float sin2_max, float distance,
                                EmitterSample* out) const {
  // 1 - cos without cancellation, so that distant spheres keep their size.
  const float one_minus_cos_max = sin2_max / (1 + std::sqrt(1 - sin2_max));
  const float h = u.x * one_minus_cos_max;  // 1 - cos(theta)
  const float sin2 = h * (2 - h);
  // The angle alpha at the centre between the sampled point and ref.
  const float sin_max = std::sqrt(sin2_max);
  const float cos_alpha = std::min(sin2 / sin_max + (1 - h) * safe_sqrt(1 - sin2 / sin2_max), 1.0f);
  const float sin_alpha = safe_sqrt(1 - cos_alpha * cos_alpha);
  const Frame frame((ref - map_.origin) * (1 / distance));
  const V3f n = normalize(frame.to_world(spherical_direction(sin_alpha, cos_alpha, 2 * pi * u.y)));
  out->p = map_.origin + n * world_radius_;
  out->n = flip_ ? -n : n;
  out->uv = uv_at(normalize(map_.to_local(out->p)));
  out->pdf = cone_pdf(one_minus_cos_max);
  return out->pdf < infinity;
}

bool SphereEmitter::sample(const V3f& ref, const V2f& u, EmitterSample* out) const {
  float sin2_max, distance;
  if (sees_cone(ref, &sin2_max, &distance)) return sample_cone(ref, u, sin2_max, distance, out);
  const float z = lerp(u.x, z_min_, z_max_) / radius_;
  const V3f n = spherical_direction(safe_sqrt(1 - z * z), z, phi_max_ * u.y);
  const V3f area_vector = map_.area_vector(n);
  out->p = map_.point(n * radius_);
  out->n = normalize(flip_ ? -area_vector : area_vector);
  out->uv = uv_at(n);
  return area_to_solid_angle(ref, out->p, out->n, area_pdf(area_vector), &out->pdf);
}

float SphereEmitter::pdf(const V3f& ref, const V3f&, const V3f& p, const V3f&) const {
  float sin2_max, distance;
  if (sees_cone(ref, &sin2_max, &distance)) return cone_pdf(sin2_max / (1 + std::sqrt(1 - sin2_max)));
  const V3f area_vector = map_.area_vector(normalize(map_.to_local(p)));
  float result;
  return area_to_solid_angle(ref, p, normalize(area_vector), area_pdf(area_vector), &result) ? result : 0;
}

}  // namespace dapple::geom
