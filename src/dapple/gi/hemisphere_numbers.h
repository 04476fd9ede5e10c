// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/vec.h"

namespace dapple::gi {

/// Fitted numbers of hemispheres.
struct HemisphereNumbers {
  /// Radians: the turn of a receiver's normal at which irradiance linear in the normal is exact for rings of light. The
  /// middle of what records reach (distribution::InterpolationNumbers::least_cosine: 37 degrees).
  static constexpr float turn = radians(30);
  /// Rings, from which the last is left out of the distance to the nearest thing: what is in it is the receiver itself,
  /// bent, or so near its plane that it gives little.
  static constexpr int rings_without_last = 6;
};

}  // namespace dapple::gi
