// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/scene/scene.h"

namespace dapple::scene {

/// Which medium lies before a surface, for points that no ray has come to: shading points, cache entries, hemispheres. A pure function of the
/// scene and the point, so that what is computed there does not depend on who asks.
///
/// Media are apart where a surface separates them (GeometryBinding::changes_medium); others stand in one. From a point the map walks along
/// the normal, through surfaces that separate nothing, to the first that does: the point lies in the medium of the side that is met. Where none
/// is met, it lies in the medium at infinity: that of the camera, carried along a ray that leaves the scene. Where media are declared
/// so that every ray agrees on them, this is the medium that a ray carries; where not, the nearest surface decides.
class MediumMap {
 public:
  explicit MediumMap(const Scene& scene);

  /// The medium at `s`, on its outside or `behind` it. `time`: within the shutter interval.
  int32_t at(uint32_t geometry, const geom::SurfacePoint& s, bool behind, float time) const {
    const GeometryBinding& binding = scene_.bindings[geometry];
    if (binding.changes_medium) return behind ? binding.inside_medium : binding.outside_medium;
    return walks_ ? walk(s.P + (behind ? -s.Ng : s.Ng) * s.error, behind ? -s.Ng : s.Ng, time) : scene_.camera_medium;
  }

 private:
  int32_t walk(V3f o, const V3f& d, float time) const;

  const Scene& scene_;
  bool walks_ = false;
  int32_t at_infinity_;
};

}  // namespace dapple::scene
