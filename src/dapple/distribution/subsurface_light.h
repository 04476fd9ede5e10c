// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/hit_gatherer.h"

namespace dapple::distribution {

/// Light that leaves subsurface bodies by diffusion: probes find the surface around each point, and what enters there
/// is gathered (docs/design/012).
class SubsurfaceLight {
 public:
  SubsurfaceLight(const ShadingScene& shading, const HitGatherer& gatherer) : shading_(shading), gatherer_(gatherer) {}

  /// Adds to b.diffuse of those points of the batch: the radiosity of the body / pi, before the boundary lets it out by
  /// direction (Bsdf::crossing).
  void light(const Place& place, ShadingWorkspace& w) const;

 private:
  int probes(const integrate::PointBatch& b, int k) const {
    return integrate::RayList::part(shading_.settings.subsurface_rays, b.share[k]);
  }
  void send(const Place& place, ShadingWorkspace& w) const;
  void trace(int n, const integrate::PointBatch& b, SubsurfaceBatch& s, ShadingWorkspace& w) const;
  void gather(const Place& place, ShadingWorkspace& w) const;
  void look_up(const Place& place, int sets, ShadingWorkspace& w) const;
  void set_ray(const SubsurfaceProbe& probe, const SubsurfaceBatch::Found& at, uint32_t key, const RGB& weight,
               const integrate::PointBatch& b, int k, integrate::RaySet& r, int i) const;

  const ShadingScene& shading_;
  const HitGatherer& gatherer_;
};

}  // namespace dapple::distribution
