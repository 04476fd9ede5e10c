// SPDX-License-Identifier: Apache-2.0
#include "dapple/base/animated_transform.h"

#include <Imath/ImathMatrixAlgo.h>

namespace dapple {
inline namespace base {

Decomposition::Decomposition(const Transform& t) {
  const M44d& m = t.matrix();
  translation = {m[0][3], m[1][3], m[2][3]};
  V3d q[3];
  for (int j = 0; j < 3; ++j) {
    q[j] = {m[0][j], m[1][j], m[2][j]};
    for (int k = 0; k < j; ++k) {
      scale[k][j] = q[k].dot(V3d(m[0][j], m[1][j], m[2][j]));
      q[j] -= q[k] * scale[k][j];
    }
    scale[j][j] = q[j].length();
    q[j] *= 1 / scale[j][j];
  }
  if (q[0].cross(q[1]).dot(q[2]) < 0)  // a mirror: keep the rotation proper
    for (int i = 0; i < 3; ++i) {
      q[i] = -q[i];
      for (int j = 0; j < 3; ++j) scale[i][j] = -scale[i][j];
    }
  // Imath's matrices act on row vectors, so the columns of R are its rows.
  Imath::M44d r;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) r[i][j] = q[i][j];
  rotation = Imath::extractQuat(r).normalized();
}

M44d Decomposition::compose() const {
  const Imath::M33d r = rotation.toMatrix33();
  M44d m;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      m[i][j] = 0;
      for (int k = 0; k < 3; ++k) m[i][j] += r[k][i] * scale[k][j];
    }
    m[i][3] = translation[i];
  }
  return m;
}

AnimatedTransform::AnimatedTransform(const Transform& start, const Transform& end)
    : start_transform_(start), end_transform_(end), start_(start), end_(end), animated_(!(start == end)) {
  if ((start_.rotation ^ end_.rotation) < 0) end_.rotation = -end_.rotation;  // the short way round
}

Transform AnimatedTransform::at(double time) const {
  if (!animated_ || time <= 0) return start_transform_;
  return time >= 1 ? end_transform_ : Transform(matrix_at(time));
}

M44d AnimatedTransform::matrix_at(double time) const {
  if (!animated_ || time <= 0) return start_transform_.matrix();
  if (time >= 1) return end_transform_.matrix();
  Decomposition d = start_;
  d.translation = start_.translation * (1 - time) + end_.translation * time;
  d.rotation = Imath::slerp(start_.rotation, end_.rotation, time);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) d.scale[i][j] = start_.scale[i][j] * (1 - time) + end_.scale[i][j] * time;
  return d.compose();
}

}  // namespace base
}  // namespace dapple
