// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/vec.h"

namespace dapple {
inline namespace base {

/// An invertible affine or projective map and its inverse. Column vectors in the mathematics: point' = M point;
/// `matrix()[row][column]`. (Imath multiplies row vectors: its matrices are the transposes of these.)
class Transform {
 public:
  Transform() = default;
  /// Rows of M. A singular M leaves is_invertible() false and the inverse undefined.
  explicit Transform(const M44d& rows);
  Transform(const M44d& rows, const M44d& inverse_rows) : m_(rows), inv_(inverse_rows) {}

  static Transform translate(const V3d& by);
  static Transform scale(const V3d& by);
  static Transform rotate(double degrees, const V3d& axis);
  /// World to camera: camera at eye, +z towards look, y near up (pbrt's LookAt). Not invertible if up is parallel.
  static Transform look_at(const V3d& eye, const V3d& look, const V3d& up);

  const M44d& matrix() const { return m_; }
  const M44d& inverse_matrix() const { return inv_; }
  Transform inverse() const { return {inv_, m_}; }
  bool is_invertible() const { return invertible_; }
  bool is_identity() const;
  bool is_finite() const;
  /// True if handedness flips: the upper 3x3 has a negative determinant.
  bool swaps_handedness() const;

  V3f point(const V3f& p) const;
  V3f vector(const V3f& v) const;
  /// Maps by the inverse transpose; not normalised.
  V3f normal(const V3f& n) const;

  friend Transform operator*(const Transform& a, const Transform& b);  ///< (a * b)(p) = a(b(p))
  friend bool operator==(const Transform& a, const Transform& b) { return a.m_ == b.m_; }

 private:
  M44d m_, inv_;
  bool invertible_ = true;
};

}  // namespace base
}  // namespace dapple
