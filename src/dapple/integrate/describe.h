// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/scene/scene.h"
#include "dapple/shading/bsdf.h"

namespace dapple::integrate {

/// What a visible surface shows in the AOVs. wo: towards the camera.
inline scene::Features describe(const scene::Scene& scene, const geom::SurfacePoint& s, const shading::Bsdf& bsdf,
                                const V3f& wo) {
  scene::Features f;
  f.alpha = 1;
  f.albedo = bsdf.albedo();
  f.normal = bsdf.normal_towards(wo);
  f.position = s.P;
  f.depth = scene.camera.world_to_camera().point(s.P).z;
  return f;
}

}  // namespace dapple::integrate
