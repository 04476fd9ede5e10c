// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/geom/affine_map.h"
#include "dapple/geom/emitter_sample.h"

namespace dapple::geom {

/// A sphere, or the part of one with z in [z_min, z_max] and phi in [0, phi_max], that emits. A whole sphere without
/// shear or stretch is drawn uniformly in solid angle (a cone) from points outside; everything else uniformly by area
/// in object space.
class SphereEmitter {
 public:
  /// z limits in object space, clamped to the radius; phi_max in radians. The normal points outwards, inwards if
  /// `flip`.
  SphereEmitter(const Transform& object_to_world, float radius, float z_min, float z_max, float phi_max, bool flip);

  bool sample(const V3f& ref, const V2f& u, EmitterSample* out) const;
  /// Density (solid angle) with which sample() returns the direction wi of p, a point of the sphere seen from ref.
  float pdf(const V3f& ref, const V3f& wi, const V3f& p, const V3f& n) const;

  float area() const { return area_; }
  Box3f bounds() const;
  NormalCone normal_cone() const { return {}; }

 private:
  bool sees_cone(const V3f& ref, float* sin2_max, float* distance) const;
  bool sample_cone(const V3f& ref, const V2f& u, float sin2_max, float distance, EmitterSample* out) const;
  float area_pdf(const V3f& area_vector) const { return 1 / (object_area_ * length(area_vector)); }
  V2f uv_at(const V3f& n_object) const;

  AffineMap map_;
  float radius_, z_min_, z_max_, phi_max_;
  float world_radius_;  // 0 unless whole and evenly scaled
  float object_area_, area_;
  bool flip_;
};

}  // namespace dapple::geom
