// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "dapple/geom/surface_point.h"

namespace dapple::geom {

enum class CurveKind {
  round,  ///< a swept tube (pbrt's "cylinder")
  flat,   ///< a ribbon that faces every ray
  ribbon  ///< a ribbon with given normals
};

/// Cubic Bezier curves of varying radius, in world space or that of an object definition.
struct CurveSet {
  struct ControlPoint {
    V3f P;
    float radius;
  };
  CurveKind kind = CurveKind::flat;
  std::vector<ControlPoint> control_points;  ///< 4 a segment
  std::vector<V3f> normals;                  ///< ribbon: 4 a segment, control normals
  std::vector<V2f> u_range;                  ///< of each segment along its curve

  size_t segment_count() const { return control_points.size() / 4; }
  size_t bytes() const;
  /// u along the segment; v across, as Embree reports it; n_hit the normal of the hit, not normalised.
  SurfacePoint at(uint32_t segment, float u, float v, const V3f& n_hit) const;
};

}  // namespace dapple::geom
