// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/ray.h"
#include "dapple/base/transform.h"
#include "dapple/geom/surface_point.h"

namespace dapple::geom {

enum class QuadricKind { sphere, disk, cylinder };

/// A sphere, disk or cylinder around the z axis of its own space, possibly cut; parameters as in pbrt-v4.
/// Rays are intersected in its own space in double precision.
class Quadric {
 public:
  static Quadric sphere(const Transform& to_world, float radius, float z_min, float z_max, float phi_max, bool flip);
  static Quadric disk(const Transform& to_world, float height, float radius, float inner_radius, float phi_max,
                      bool flip);
  static Quadric cylinder(const Transform& to_world, float radius, float z_min, float z_max, float phi_max, bool flip);

  /// The nearest hit with t in (t_min, t_max); u, v in [0, 1]^2. The direction need not be unit.
  bool intersect(const V3f& o, const V3f& d, float t_min, float t_max, float* t, float* u, float* v) const;
  SurfacePoint at(float u, float v) const;
  Box3f bounds() const;  ///< world space
  float area() const;    ///< world space, exact for uniform scales

  QuadricKind kind() const { return kind_; }
  const Transform& to_world() const { return to_world_; }
  float radius() const { return radius_; }
  float inner_radius() const { return inner_radius_; }
  float z_min() const { return z_min_; }
  float z_max() const { return z_max_; }
  float phi_max() const { return phi_max_; }
  bool flip() const { return flip_; }

  friend bool operator==(const Quadric&, const Quadric&) = default;

 private:
  Quadric(QuadricKind kind, const Transform& to_world, bool flip);
  bool accept(const V3d& p, float* u, float* v) const;

  QuadricKind kind_;
  Transform to_world_;
  bool flip_;
  float radius_ = 1, inner_radius_ = 0;
  float z_min_ = -1, z_max_ = 1;
  float theta_min_ = 0, theta_max_ = 0;  ///< sphere: polar angles at z_min and z_max, pbrt's theta from -z
  float phi_max_ = 2 * pi;               ///< radians
};

}  // namespace dapple::geom
