// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/hit_gatherer.h"

namespace dapple::distribution {

/// Light that media scatter into rays, at the places where these scattered.
class MediaLight {
 public:
  MediaLight(const ShadingScene& shading, const CachedRadiosity& cached, const HitGatherer& gatherer)
      : shading_(shading), cached_(cached), gatherer_(gatherer) {}

  /// b.Ci of points in media (set_flight): the lights' and, up to the specular depth, what one ray by the phase
  /// function brings.
  void shade(const Place& place, ShadingWorkspace& w) const;

 private:
  const ShadingScene& shading_;
  const CachedRadiosity& cached_;
  const HitGatherer& gatherer_;
};

}  // namespace dapple::distribution
