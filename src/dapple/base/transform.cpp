// SPDX-License-Identifier: Apache-2.0
#include "dapple/base/transform.h"

namespace dapple {
inline namespace base {

namespace {

// Gauss-Jordan with full pivoting; false for a singular or non-finite matrix.
bool invert(const M44d& m, M44d* out) {
  double a[4][8];
  double scale = 0;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      if (!std::isfinite(m[i][j])) return false;
      scale = std::max(scale, std::abs(m[i][j]));
      a[i][j] = m[i][j];
      a[i][4 + j] = i == j ? 1 : 0;
    }
  for (int column = 0; column < 4; ++column) {
    int pivot = column;
    for (int i = column + 1; i < 4; ++i)
      if (std::abs(a[i][column]) > std::abs(a[pivot][column])) pivot = i;
    // Film scenes hold scales of 1e-6 beside translations of 1e4, so only true collapse counts as singular.
    if (std::abs(a[pivot][column]) <= scale * 1e-300 || a[pivot][column] == 0) return false;
    for (int j = 0; j < 8; ++j) std::swap(a[column][j], a[pivot][j]);
    const double inv = 1 / a[column][column];
    for (int j = 0; j < 8; ++j) a[column][j] *= inv;
    for (int i = 0; i < 4; ++i) {
      if (i == column) continue;
      const double f = a[i][column];
      for (int j = 0; j < 8; ++j) a[i][j] -= f * a[column][j];
    }
  }
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      (*out)[i][j] = a[i][4 + j];
      if (!std::isfinite((*out)[i][j])) return false;
    }
  return true;
}

M44d multiply(const M44d& a, const M44d& b) {
  M44d r;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      double s = 0;
      for (int k = 0; k < 4; ++k) s += a[i][k] * b[k][j];
      r[i][j] = s;
    }
  return r;
}

}  // namespace

Transform::Transform(const M44d& rows) : m_(rows) {
  invertible_ = invert(m_, &inv_);
}

Transform Transform::translate(const V3d& d) {
  return {M44d(1, 0, 0, d.x, 0, 1, 0, d.y, 0, 0, 1, d.z, 0, 0, 0, 1),
          M44d(1, 0, 0, -d.x, 0, 1, 0, -d.y, 0, 0, 1, -d.z, 0, 0, 0, 1)};
}

Transform Transform::scale(const V3d& s) {
  return Transform(M44d(s.x, 0, 0, 0, 0, s.y, 0, 0, 0, 0, s.z, 0, 0, 0, 0, 1));
}

Transform Transform::rotate(double degrees, const V3d& axis) {
  const V3d a = axis.normalized();
  const double theta = degrees * std::numbers::pi / 180, s = std::sin(theta), c = std::cos(theta);
  M44d m;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) m[i][j] = (i == j ? c : 0) + (1 - c) * a[i] * a[j];
  m[0][1] -= a.z * s, m[0][2] += a.y * s;
  m[1][0] += a.z * s, m[1][2] -= a.x * s;
  m[2][0] -= a.y * s, m[2][1] += a.x * s;
  return {m, m.transposed()};
}

Transform Transform::look_at(const V3d& eye, const V3d& look, const V3d& up) {
  const V3d dir = (look - eye).normalized();
  const V3d right = up.normalized().cross(dir).normalized();
  const V3d new_up = dir.cross(right);
  const M44d camera_to_world(right.x, new_up.x, dir.x, eye.x, right.y, new_up.y, dir.y, eye.y, right.z, new_up.z, dir.z,
                             eye.z, 0, 0, 0, 1);
  Transform t(camera_to_world);
  Transform inverse = t.inverse();
  inverse.invertible_ = t.invertible_;
  return inverse;
}

bool Transform::is_identity() const {
  return m_ == M44d();
}

bool Transform::is_finite() const {
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      if (!std::isfinite(m_[i][j])) return false;
  return true;
}

bool Transform::swaps_handedness() const {
  const auto& m = m_;
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
             m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]) <
         0;
}

V3f Transform::point(const V3f& p) const {
  const auto& m = m_;
  const double x = m[0][0] * p.x + m[0][1] * p.y + m[0][2] * p.z + m[0][3];
  const double y = m[1][0] * p.x + m[1][1] * p.y + m[1][2] * p.z + m[1][3];
  const double z = m[2][0] * p.x + m[2][1] * p.y + m[2][2] * p.z + m[2][3];
  const double w = m[3][0] * p.x + m[3][1] * p.y + m[3][2] * p.z + m[3][3];
  return w == 1 ? V3f(float(x), float(y), float(z)) : V3f(float(x / w), float(y / w), float(z / w));
}

V3f Transform::vector(const V3f& v) const {
  const auto& m = m_;
  return {float(m[0][0] * v.x + m[0][1] * v.y + m[0][2] * v.z), float(m[1][0] * v.x + m[1][1] * v.y + m[1][2] * v.z),
          float(m[2][0] * v.x + m[2][1] * v.y + m[2][2] * v.z)};
}

V3f Transform::normal(const V3f& n) const {
  const auto& m = inv_;
  return {float(m[0][0] * n.x + m[1][0] * n.y + m[2][0] * n.z), float(m[0][1] * n.x + m[1][1] * n.y + m[2][1] * n.z),
          float(m[0][2] * n.x + m[1][2] * n.y + m[2][2] * n.z)};
}

Transform operator*(const Transform& a, const Transform& b) {
  Transform t(multiply(a.m_, b.m_), multiply(b.inv_, a.inv_));
  t.invertible_ = a.invertible_ && b.invertible_;
  return t;
}

}  // namespace base
}  // namespace dapple
