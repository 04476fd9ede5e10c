// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/hit_shader.h"
#include "dapple/gi/cache_answers.h"

namespace dapple::distribution {

/// Says what answers the diffuse rays of points, for pictures of the radiosity cache. Lights nothing and changes no
/// cache.
class CacheSurvey {
 public:
  CacheSurvey(const ShadingScene& shading, const HitShader& shader, const gi::CacheLog& log)
      : shading_(shading), shader_(shader), log_(log) {}

  /// What answers the first diffuse rays of the points of the batch, after prelight(): answers[k].
  void ask(const Place& place, gi::CacheAnswers* answers, ShadingWorkspace& w) const;

 private:
  void ask_rays(const Place& place, gi::CacheAnswers* answers, ShadingWorkspace& w) const;

  const ShadingScene& shading_;
  const HitShader& shader_;
  const gi::CacheLog& log_;
};

}  // namespace dapple::distribution
