// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <embree3/rtcore.h>

#include <cstdint>

#include "dapple/base/animated_transform.h"
#include "dapple/geom/surface_point.h"

namespace dapple::trace {

/// An object placed in the world: the map world from object space, which Embree interpolates where it moves. `time` is
/// that of the shutter interval, 0 to 1.
struct Instance {
  float m[3][4];  ///< at shutter open
  float scale;    ///< the largest along an axis, at shutter open
  uint32_t object;
  RTCGeometry animated;  ///< null unless the transform moves

  void rows(float time, float out[3][4]) const;
  V3f world_point(const V3f& p) const;  ///< at shutter open
  V3f object_point(const V3f& world, float time) const;
  /// Ng and Ns stay on the outside, tangents what they are along the surface. dPdu to dNdv are left as they are where
  /// `tangents` are not wanted.
  geom::SurfacePoint to_world(const geom::SurfacePoint& local, float time, bool tangents) const;
};

/// geometry: Embree's, null for a map that does not move.
Instance instance_of(uint32_t object, const AnimatedTransform& motion, RTCGeometry geometry);

}  // namespace dapple::trace
