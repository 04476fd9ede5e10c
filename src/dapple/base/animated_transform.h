// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Imath/ImathQuat.h>

#include "dapple/base/transform.h"

namespace dapple {
inline namespace base {

/// M = T R S: translation, rotation, and an upper triangular scale and shear (Gram-Schmidt), as Embree's motion
/// quaternions want.
struct Decomposition {
  V3d translation{0, 0, 0};
  Imath::Quatd rotation;
  double scale[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};  ///< zero below the diagonal

  explicit Decomposition(const Transform& affine);
  M44d compose() const;
};

/// A transform that moves over the shutter interval: translation and scale linearly, rotation by slerp. All headers but
/// scene/camera.h call the ends of that motion shutter open and close, times 0 and 1; the camera's own shutter may be
/// open for a part of it.
class AnimatedTransform {
 public:
  AnimatedTransform() : AnimatedTransform(Transform(), Transform()) {}
  AnimatedTransform(const Transform& start, const Transform& end);

  bool is_animated() const { return animated_; }
  const Transform& start() const { return start_transform_; }
  const Transform& end() const { return end_transform_; }
  const Decomposition& decomposition(int end) const { return end ? end_ : start_; }
  Transform at(double time) const;  ///< time in [0, 1]
  M44d matrix_at(double time) const;

 private:
  Transform start_transform_, end_transform_;
  Decomposition start_, end_;
  bool animated_;
};

}  // namespace base
}  // namespace dapple
