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
  float time = 0;  ///< 0 at shutter open, 1 at shutter close.
};

/// Change of a ray's origin and direction from one pixel to the next in x and in y (Igehy 1999).
struct RayDifferential {
  V3f dodx{0, 0, 0}, dody{0, 0, 0};
  V3f dddx{0, 0, 0}, dddy{0, 0, 0};
};

}  // namespace base
}  // namespace dapple
