// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/hit_shader.h"
#include "dapple/integrate/radiosity_answers.h"

namespace dapple::distribution {

/// Ends diffuse rays of the path integrator in the radiosity cache, as CachedRadiosity does with those of shading
/// points: camera samples are traced as paths, whose rays cost .6 as much as those of batches of shading points, and
/// cells are filled by distribution ray tracing.
class PathAnswers final : public integrate::RadiosityAnswers {
 public:
  /// All must outlive this object.
  PathAnswers(const ShadingScene& shading, const HitShader& shader, const gi::RadiosityCache& cache, int light_groups)
      : shading_(shading), shader_(shader), cache_(cache), groups_(light_groups) {}

  std::unique_ptr<Workspace> make_workspace() const override;
  int groups() const override { return groups_; }
  void answer(integrate::DiffuseHits& hits, Workspace& w) const override;
  std::vector<integrate::CacheState> caches() const override { return states(cache_, 1, shading_.settings.bounces); }
  void collect_counts(Workspace& w, integrate::RayCounts* rays, integrate::StageCounts* stages,
                      std::span<integrate::CacheCounts> caches) const override;

  /// The cache by resolution, and by diffuse depths from the first to the last.
  static std::vector<integrate::CacheState> states(const gi::RadiosityCache& cache, int first_depth, int last_depth);
  /// Counts since the last time, in the order of states().
  static void collect(gi::RadiosityCache::Counts& counts, int first_depth, int last_depth, integrate::CacheCounts* to);

 private:
  struct Scratch;
  void answer_depth(int depth, integrate::DiffuseHits& hits, ShadingWorkspace& w) const;
  float chance_of_coat(const integrate::RaySet& r, int ray) const;

  const ShadingScene& shading_;
  const HitShader& shader_;
  const gi::RadiosityCache& cache_;
  const int groups_;
};

}  // namespace dapple::distribution
