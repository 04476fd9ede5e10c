// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "dapple/base/transform.h"
#include "dapple/geom/surface_point.h"

namespace dapple::geom {

/// Many flat disks, as leaves of canopies for radiative transfer are often given, in world space or that of an object
/// definition. 28 bytes a disk; u and v run around and inwards as on pbrt's disk.
struct DiskCloud {
  struct Disk {
    V3f centre;
    float radius;  ///< above 0
  };
  std::vector<Disk> disks;
  std::vector<V3f> normals;  ///< unit, outside; one a disk

  size_t bytes() const { return disks.size() * sizeof(Disk) + normals.size() * sizeof(V3f); }
  /// u: turn around the normal, v: 1 at the centre, 0 at the rim.
  SurfacePoint at(uint32_t disk, float u, float v) const;
  /// u and v of a point in the plane of a disk.
  V2f parameters(uint32_t disk, const V3f& p) const;
  /// Takes the disks to another space, and turns their outsides over if `flip`. False, and nothing is done, where disks
  /// would become ellipses: the map must be a rotation or reflection with uniform scale.
  bool transform(const Transform& to_target, bool flip);
};

}  // namespace dapple::geom
