// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/vec.h"

namespace dapple::geom {

/// Local geometry of a surface at a parametric position, in the space of its shape (or in world space where stated).
struct SurfacePoint {
  V3f P{0, 0, 0};
  V3f Ng{0, 0, 1};  ///< unit geometric normal, outside
  V3f Ns{0, 0, 1};  ///< unit shading normal, same side as Ng
  V3f dPdu{1, 0, 0}, dPdv{0, 1, 0};
  V3f dNdu{0, 0, 0}, dNdv{0, 0, 0};
  float u = 0, v = 0;
  /// Bound on the absolute error of P from its arithmetic, in the units of P.
  float error = 0;
};

/// The part of `error` that interpolation in single precision leaves at coordinates as large as p.
inline float position_error(const V3f& p) {
  return 0x1p-19f * std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
}

/// Fills the normals and tangents of a flat or smooth triangle from its corners. Outside is where the normals point;
/// without normals, where cross(corner 1 - corner 0, corner 2 - corner 0) points, or the other side if `flip`. dPdu to
/// dNdv are set if `tangents`.
void complete_triangle(const V3f corners[3], const V3f* normals, const V2f* uv, float b1, float b2, bool flip,
                       bool tangents, SurfacePoint* out);

}  // namespace dapple::geom
