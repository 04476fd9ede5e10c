// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/media_light.h"
#include "dapple/distribution/subsurface_light.h"

namespace dapple::distribution {

/// Runs the stages of surface shaders on batches of points by distribution ray tracing (Cook et al. 1984): shadow rays
/// to the lights, diffuse rays, specular rays, and the same at what those hit. Radiance and irradiance are unbiased
/// estimates, but for what Arrival says.
///
/// Diffuse points take lights by shadow rays and by diffuse rays that meet them (DirectLight, PointBatch::seekers),
/// other points by shadow and specular rays.
class HitShader final : public PointShader {
 public:
  /// The caches: as CachedRadiosity has them. All must outlive this object.
  HitShader(const ShadingScene& shading, const PointPlacer& placer, gi::RadiosityCache* radiosity,
            gi::RadiosityCache* irradiance = nullptr);
  HitShader(const HitShader&) = delete;

  const CachedRadiosity& cached() const { return cached_; }
  const DiffuseRays& diffuse_rays() const { return diffuse_rays_; }
  const HitGatherer& gatherer() const { return gatherer_; }
  /// Draws the rays by Bsdfs that are jobs of the workspace.
  void draw_specular_rays(const Place& place, integrate::RaySet& r, ShadingWorkspace& w) const;

  /// Runs all stages: b.Ci.
  void shade(const Place& place, ShadingWorkspace& w) const override;
  void shade_diffuse(const Place& place, ShadingWorkspace& w) const override;
  void shade_media(const Place& place, ShadingWorkspace& w) const override { media_.shade(place, w); }

  // shade() in steps, for callers that keep what a step gives.
  void prelight(const Place& place, ShadingWorkspace& w) const;
  /// Light by the diffuse lobes: b.irradiance, b.irradiance_behind, b.diffuse. Zero where the Bsdf is not purely
  /// diffuse. From points of b.indirect_known diffuse rays look for skies alone.
  void light_diffuse(const Place& place, ShadingWorkspace& w) const;
  /// Light by all lobes of what is not purely diffuse: b.specular.
  static RGB disperse(integrate::PointBatch& b, int k);
  void light_specular(const Place& place, ShadingWorkspace& w) const;
  /// specularlighting and postlighting, for viewers: b.Ci.
  void finish(integrate::PointBatch& b, Arrival arrival, ShadingWorkspace& w) const;

 private:
  void send_diffuse_rays(const Place& place, const bool* scattering, ShadingWorkspace& w) const;
  static void add_light(integrate::PointBatch& b, int sets);
  void send_specular_rays(const Place& place, ShadingWorkspace& w) const;

  const ShadingScene& shading_;
  const DiffuseRays diffuse_rays_;
  const CachedRadiosity cached_;
  const HitGatherer gatherer_;
  const MediaLight media_;
  const SubsurfaceLight subsurface_;
};

}  // namespace dapple::distribution
