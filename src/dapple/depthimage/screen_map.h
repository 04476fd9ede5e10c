// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/vec.h"

namespace dapple::depthimage {

/// Rows of an affine map.
struct Placement {
  float m[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};

  V3f point(const V3f& p) const {
    V3f out;
    for (int r = 0; r < 3; ++r) out[r] = m[r][0] * p.x + m[r][1] * p.y + m[r][2] * p.z + m[r][3];
    return out;
  }
  V3f vector(const V3f& v) const {
    V3f out;
    for (int r = 0; r < 3; ++r) out[r] = m[r][0] * v.x + m[r][1] * v.y + m[r][2] * v.z;
    return out;
  }
  /// Of a plane's unit normal; on the side that it was on. Not normalised; 0 only where the map has no inverse.
  V3f normal(const V3f& n) const {
    const V3f x(m[0][0], m[1][0], m[2][0]), y(m[0][1], m[1][1], m[2][1]), z(m[0][2], m[1][2], m[2][2]);
    const V3f out = cross(y, z) * n.x + cross(z, x) * n.y + cross(x, y) * n.z;
    return dot(x, cross(y, z)) < 0 ? -out : out;
  }
  /// The largest length of an axis' image.
  float scale() const {
    float most = 0;
    for (int c = 0; c < 3; ++c) most = std::max(most, sqr(m[0][c]) + sqr(m[1][c]) + sqr(m[2][c]));
    return std::sqrt(most);
  }
};

/// From points to the film, homogeneous: (X / W, Y / W) in pixels from its upper left, and Z, the depth along the
/// camera's axis, above 0 in front of it.
struct ScreenMap {
  enum Row { X, Y, W, Z };
  float m[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 0, 1}, {0, 0, 1, 0}};

  float apply(Row r, const V3f& p) const { return m[r][0] * p.x + m[r][1] * p.y + m[r][2] * p.z + m[r][3]; }
  float apply_vector(Row r, const V3f& v) const { return m[r][0] * v.x + m[r][1] * v.y + m[r][2] * v.z; }
  bool is_perspective() const { return m[W][0] != 0 || m[W][1] != 0 || m[W][2] != 0; }
  V2f film(const V3f& p) const { return V2f(apply(X, p), apply(Y, p)) / apply(W, p); }
  ScreenMap after(const Placement& first) const {
    ScreenMap out;
    out.scale = scale;
    for (int r = 0; r < 4; ++r)
      for (int c = 0; c < 4; ++c) {
        out.m[r][c] = c == 3 ? m[r][3] : 0;
        for (int k = 0; k < 3; ++k) out.m[r][c] += m[r][k] * first.m[k][c];
      }
    return out;
  }
  /// Pixels along the film that a length across the axis takes, at a depth.
  float pixels_at(float depth) const {
    const float across = std::sqrt(sqr(m[X][0]) + sqr(m[X][1]) + sqr(m[X][2])),
                along = std::sqrt(sqr(m[W][0]) + sqr(m[W][1]) + sqr(m[W][2]));
    return along > 0 ? scale / std::max(depth, 1e-30f) : across;
  }
  float scale = 1;  ///< of perspective: pixels a metre at depth 1
};

}  // namespace dapple::depthimage
