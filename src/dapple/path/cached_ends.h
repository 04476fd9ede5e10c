// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "dapple/path/path_workspace.h"

namespace dapple::path {

/// Ends diffuse rays of paths where a cache knows what leaves the surfaces that they met. Coats keep their mirroring:
/// some paths go on by it alone.
class CachedEnds {
 public:
  /// `answers`: null where there is no cache. `width_scale`: of footprints, over PathWorkspace::cone_width.
  CachedEnds(std::shared_ptr<const integrate::RadiosityAnswers> answers, float width_scale)
      : answers_(std::move(answers)), width_scale_(width_scale) {}

  explicit operator bool() const { return answers_ != nullptr; }
  void prepare(PathWorkspace& w) const;
  /// The path's next ray leaves a surface; by a diffuse lobe, which may be looked up where it ends, or by others.
  void note_ray(int path, bool may_end, PathWorkspace& w) const {
    if (answers_) w.reader[path] = {may_end, w.cone_width[path] * width_scale_, 0};
  }
  /// Adds what the cache answers of the hits of this step, and says in w.left what is left to do.
  void end_rays(PathWorkspace& w) const;

  std::vector<integrate::CacheState> caches() const;
  void collect_counts(PathWorkspace& w) const;

 private:
  const std::shared_ptr<const integrate::RadiosityAnswers> answers_;
  const float width_scale_;
};

}  // namespace dapple::path
