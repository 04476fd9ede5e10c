// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/hider.h"
#include "dapple/distribution/sample_finisher.h"

namespace dapple::distribution {

/// Finds out, before rendering, how many diffuse rays will end where: by a few paths from the camera, a fixed part of
/// the image's samples. Where rays read the cache, a path goes on with the chance of a ray that fills send for each ray
/// that reads them. A function of scene, settings and film, not of what is cropped.
class ReaderSurvey final : public PointShader {
 public:
  /// All must outlive this object.
  ReaderSurvey(const ShadingScene& shading, const PointPlacer& placer, const HitShader& shader, const Hider& hider,
               const SampleFinisher& finisher, const DistributionSettings& settings);
  ReaderSurvey(const ReaderSurvey&) = delete;

  /// Adds all depths of diffuse rays. May throw Stopped. Reads ShadingScene::readers, which may be what is filled.
  void fill(SurveyedReaders* found) const;

  // Follow paths: send one ray from each point, and light nothing.
  void shade(const Place& place, ShadingWorkspace& w) const override;
  void shade_diffuse(const Place& place, ShadingWorkspace& w) const override { shade(place, w); }
  void shade_media(const Place& place, ShadingWorkspace& w) const override;

 private:
  struct Workspace;
  void trace_camera_rays(uint32_t first, int count, Workspace& w) const;
  void send_diffuse_rays(const Place& place, ShadingWorkspace& w) const;
  void send_specular_rays(const Place& place, ShadingWorkspace& w) const;
  void note_readers(const Place& place, const RayFilter& wanted, Workspace& w) const;

  const ShadingScene& shading_;
  const HitShader& shader_;
  const Hider& hider_;
  const SampleFinisher& finisher_;
  const DistributionSettings& settings_;
  const CachedRadiosity uncached_;
  const HitGatherer gatherer_;
};

}  // namespace dapple::distribution
