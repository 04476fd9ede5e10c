// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/scene/scene.h"

namespace dapple::integrate {

/// What a visible surface shows in the AOVs.
inline scene::Features describe(const scene::Scene& scene, const geom::SurfacePoint& s) {
  scene::Features f;
  f.alpha = 1;
  f.position = s.P;
  f.depth = scene.camera.world_to_camera().point(s.P).z;
  return f;
}

}  // namespace dapple::integrate
