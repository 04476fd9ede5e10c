// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "dapple/base/stop_token.h"
#include "dapple/integrate/integrator.h"
#include "dapple/integrate/light_sums.h"
#include "dapple/trace/ray_batch.h"

namespace dapple::integrate {

/// What diffuse rays of a batch met: some of its rays, `ray`, and of each what says how coarse an answer may be; and
/// the answers.
struct DiffuseHits {
  static constexpr int capacity = trace::RayBatch::capacity;

  /// `groups`: of lights, whose parts are kept apart.
  explicit DiffuseHits(int groups) : L(groups) {}

  const trace::RayBatch* rays = nullptr;
  const trace::HitBatch* hits = nullptr;
  int count = 0;
  int ray[capacity];
  int depth[capacity];       ///< diffuse scatterings between the camera and the hit, 1 and more
  float width[capacity];     ///< of the footprint of the point that sent the ray, m
  float pdf[capacity];       ///< with which its direction was drawn, 1/sr
  float distance[capacity];  ///< m, from that point to the hit
  int32_t medium[capacity];  ///< in which the ray arrives

  bool known[capacity];    ///< L says what leaves the surface along the ray by its diffuse lobes, direct and indirect
  float onward[capacity];  ///< of known ones: the chance with which a path should go on by what a coat mirrors there;
                           ///< 0: there is none
  LightSums L;
};

/// Knows what leaves surfaces that diffuse rays met, coarsely: a radiosity cache (Christensen et al. 2012). One object
/// serves all threads; what changes lives in a Workspace, one a thread at a time.
class RadiosityAnswers {
 public:
  class Workspace {
   public:
    virtual ~Workspace() = default;
    StopToken stop;
  };

  virtual ~RadiosityAnswers() = default;
  virtual std::unique_ptr<Workspace> make_workspace() const = 0;
  virtual int groups() const = 0;  ///< of lights, in the answers
  /// A pure function of each hit. May throw Stopped.
  virtual void answer(DiffuseHits& hits, Workspace& w) const = 0;
  /// As Integrator's.
  virtual std::vector<CacheState> caches() const = 0;
  /// Adds what was counted since the last time; `caches` in the order of caches().
  virtual void collect_counts(Workspace& w, RayCounts* rays, StageCounts* stages,
                              std::span<CacheCounts> caches) const = 0;
};

}  // namespace dapple::integrate
