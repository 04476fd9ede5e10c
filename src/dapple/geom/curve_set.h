// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "dapple/geom/surface_point.h"

namespace dapple::geom {

enum class CurveKind {
  round,  ///< a swept tube (pbrt's "cylinder")
  flat,   ///< a ribbon that faces every ray: also those that leave it, which start on its axis so as not to meet it
  ribbon  ///< a ribbon with given normals
};

/// Cubic Bezier curves of varying radius, in world space or that of an object definition.
struct CurveSet {
  struct ControlPoint {
    V3f P;
    float radius;
  };
  /// Flat curves are drawn as so many quads a segment.
  static constexpr int flat_quads = 8;

  CurveKind kind = CurveKind::flat;
  std::vector<ControlPoint> control_points;  ///< 4 a segment
  std::vector<V3f> normals;                  ///< ribbon: 4 a segment, control normals
  std::vector<V2f> u_range;                  ///< of each segment along its curve

  size_t segment_count() const { return control_points.size() / 4; }
  size_t bytes() const;
  /// u along the segment; v from -1 to 1 across; n_hit the normal of the hit, not normalised: for flat curves any
  /// vector to where they are seen from.
  SurfacePoint at(uint32_t segment, float u, float v, const V3f& n_hit) const;
  /// v of the place of a tube where the normal is n, seen from the direction `view`: 0 in the middle, -1 and 1 on the
  /// outlines.
  float across_tube(uint32_t segment, float u, const V3f& n, const V3f& view) const;
};

}  // namespace dapple::geom
