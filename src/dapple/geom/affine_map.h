// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/transform.h"

namespace dapple::geom {

/// The affine part of an object-to-world transform, in the form sampling wants: 48 bytes, and how it changes areas.
struct AffineMap {
  V3f x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1}, origin{0, 0, 0};  ///< images of the axes and of the origin

  AffineMap() = default;
  explicit AffineMap(const Transform& t)
      : x(t.vector({1, 0, 0})), y(t.vector({0, 1, 0})), z(t.vector({0, 0, 1})), origin(t.point({0, 0, 0})) {}

  V3f point(const V3f& p) const { return origin + x * p.x + y * p.y + z * p.z; }
  float determinant() const { return dot(x, cross(y, z)); }
  /// Inverse of point().
  V3f to_local(const V3f& p) const {
    const V3f q = p - origin;
    return V3f(dot(cross(y, z), q), dot(cross(z, x), q), dot(cross(x, y), q)) * (1 / determinant());
  }
  /// World area over object area around a point of unit normal n (object space), as the length of a vector that is also
  /// the outward world normal (Nanson's formula).
  V3f area_vector(const V3f& n) const {
    const V3f a = cross(y, z) * n.x + cross(z, x) * n.y + cross(x, y) * n.z;
    return determinant() < 0 ? -a : a;
  }
  /// The scale, where all directions scale alike; else 0.
  float uniform_scale() const {
    const float sx = length(x), sy = length(y), sz = length(z), tol = 1e-5f * sx * sx;
    const bool alike = std::abs(sx * sx - sy * sy) <= 4 * tol && std::abs(sx * sx - sz * sz) <= 4 * tol &&
                       std::abs(dot(x, y)) <= tol && std::abs(dot(y, z)) <= tol && std::abs(dot(z, x)) <= tol;
    return alike ? (sx + sy + sz) / 3 : 0;
  }
};

}  // namespace dapple::geom
