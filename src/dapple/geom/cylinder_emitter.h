// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/geom/affine_map.h"
#include "dapple/geom/emitter_sample.h"

namespace dapple::geom {

/// An open cylinder around z with z in [z_min, z_max] and phi in [0, phi_max] that emits. A whole one that shines
/// outwards only is drawn, from points outside of it, where they see it: uniformly in the angle across its axis, and in
/// the angle along it unless it is far away. Everything else is drawn uniformly by area in object space.
class CylinderEmitter {
 public:
  /// Object space; phi_max in radians. The normal points away from the axis, towards it if `flip`.
  CylinderEmitter(const Transform& object_to_world, float radius, float z_min, float z_max, float phi_max, bool flip);

  /// To be called before it is sampled, if its back shines too: that is seen through its open ends.
  void shine_on_both_sides() { outwards_only_ = false; }

  bool sample(const V3f& ref, const V2f& u, EmitterSample* out) const;
  /// Density (solid angle) with which sample() returns the direction wi of p, a point of the cylinder seen from ref.
  float pdf(const V3f& ref, const V3f& wi, const V3f& p, const V3f& n) const;

  float area() const { return area_; }
  Box3f bounds() const;
  NormalCone normal_cone() const { return {}; }

 private:
  struct View;
  float area_pdf(const View& view, const V3f& n_object, float z) const;

  AffineMap map_;
  float radius_, z_min_, z_max_, phi_max_;
  float object_area_, area_;
  bool flip_, outwards_only_;
};

}  // namespace dapple::geom
