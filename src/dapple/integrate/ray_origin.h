// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/emitters/light.h"
#include "dapple/geom/surface_point.h"

namespace dapple::integrate {

/// Where a ray along `direction` starts, so that it does not meet the surface it leaves: a geom::SurfacePoint, or a
/// RayOrigin.
template <class Place>
V3f offset_origin(const Place& s, const V3f& direction) {
  return s.P + s.Ng * (dot(direction, s.Ng) < 0 ? -s.error : s.error);
}

/// A place on the cell of a shading point from which some of its rays start.
struct RayOrigin {
  V3f P, Ng;
  V3f turn;  ///< what the normal there differs by
  float error;
  float time;
  static constexpr int32_t of_point = -3;
  int32_t medium = of_point;  ///< in which rays leave there, where it need not be that of the shading point

  /// The normal there, where that of the shading point, bumps included, is n.
  V3f normal(const V3f& n) const { return turn == V3f(0, 0, 0) ? n : normalize(n + turn); }
};

/// A ray from `origin`, which was moved off the receiver at p, to what Light::sample found from p: aimed anew, and
/// short of the light by a little so that it does not shadow itself. A light in the receiver's own plane sends nothing:
/// rounding alone says on which side of the other each is, as for the back of a light that shines on one side.
struct ShadowRay {
  V3f d;
  float distance;  ///< 0: none

  ShadowRay(const V3f& p, const emitters::LightSample& light, const V3f& origin)
      : d(light.wi), distance(light.distance) {
    if (std::isinf(light.distance)) return;
    const V3f offset = origin - p;
    if (std::abs(dot(light.wi, offset)) * light.distance < 4 * length2(offset)) {
      distance = 0;
      return;
    }
    const V3f to_light = p + light.wi * light.distance - origin;
    const float length = dapple::length(to_light);
    if (length > 0) d = to_light * (1 / length);
    distance = length * (1 - 1e-4f);
  }
};

}  // namespace dapple::integrate
