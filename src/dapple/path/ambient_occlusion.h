// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/integrate/integrator.h"
#include "dapple/integrate/material_table.h"
#include "dapple/integrate/ray_tracer.h"

namespace dapple::path {

/// Ambient occlusion: the cosine-weighted share of the hemisphere over a visible point in which rays meet nothing
/// within a distance (Zhukov et al. 1998; Landis 2002). White where nothing is near; bump, normal maps and cut-outs
/// count. With colour bleeding, the point's own reflectance tints it, and what rays meet shows its reflectance as if
/// lit by half the sky.
class AmbientOcclusion final : public integrate::Integrator {
 public:
  struct Settings {
    int rays = 4;                   ///< a camera sample
    float max_distance = infinity;  ///< m
    bool color_bleeding = false;
    uint64_t seed = 0;
  };

  AmbientOcclusion(const scene::Scene& scene, const Settings& settings)
      : scene_(scene), settings_(settings), materials_(scene), tracer_(scene, materials_, false) {}

  std::unique_ptr<Workspace> make_workspace() const override;
  void render(const integrate::TileWork& work, Workspace& workspace, scene::Film& film) const override;

 private:
  struct OcclusionWorkspace;
  void trace_camera_rays(OcclusionWorkspace& w) const;
  void trace_hemispheres(OcclusionWorkspace& w) const;
  void gather(OcclusionWorkspace& w) const;

  const scene::Scene& scene_;
  const Settings settings_;
  const integrate::MaterialTable materials_;
  const integrate::RayTracer tracer_;
};

}  // namespace dapple::path
