// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/geom/affine_map.h"
#include "dapple/geom/emitter_sample.h"

namespace dapple::geom {

/// A disk at z = height, or the part of one with radius in [inner_radius, radius] and phi in [0, phi_max], that emits.
/// Uniform by area.
class DiskEmitter {
 public:
  /// Object space; phi_max in radians. The normal is +z, -z if `flip`.
  DiskEmitter(const Transform& object_to_world, float height, float radius, float inner_radius, float phi_max,
              bool flip);

  bool sample(const V3f& ref, const V2f& u, EmitterSample* out) const;
  /// Density (solid angle) with which sample() returns the direction wi of p, a point of the disk seen from ref.
  float pdf(const V3f& ref, const V3f& wi, const V3f& p, const V3f& n) const;

  float area() const { return area_; }
  Box3f bounds() const;
  NormalCone normal_cone() const { return {n_, 1}; }

 private:
  AffineMap map_;
  float height_, radius_, inner_radius_, phi_max_;
  V3f n_;
  float area_;
};

}  // namespace dapple::geom
