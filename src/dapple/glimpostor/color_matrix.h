// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/vec.h"

namespace dapple::glimpostor {

/// What old hardware did to RGBA on its way: out = M in + bias, clamped.
struct ColorMatrix {
  float rows[4][4] = {};
  float bias[4] = {};

  /// Shades normals kept as c = (n + 1) / 2: l . n = 2 l . c - (l_x + l_y + l_z) in R, G and B (Max, Deussen and
  /// Keating 1999); alpha, where depth is, passes. to_light: in the space of the normals, so that it stands for the
  /// rotation.
  static ColorMatrix shading(const V3f& to_light) {
    ColorMatrix m;
    for (int row = 0; row < 3; ++row) {
      for (int k = 0; k < 3; ++k) m.rows[row][k] = 2 * to_light[k];
      m.bias[row] = -(to_light.x + to_light.y + to_light.z);
    }
    m.rows[3][3] = 1;
    return m;
  }
};

}  // namespace dapple::glimpostor
