// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/vec.h"

namespace dapple {
inline namespace base {

/// A ray; d is the direction of propagation, unit where a header does not say otherwise.
struct Ray {
  V3f o{0, 0, 0};
  V3f d{0, 0, 1};
  float t_max = infinity;
  float time = 0;  ///< 0 at shutter open, 1 at shutter close (AnimatedTransform)
};

}  // namespace base
}  // namespace dapple
