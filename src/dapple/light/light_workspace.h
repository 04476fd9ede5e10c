// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/emitters/light_sampler.h"
#include "dapple/integrate/point_batch.h"
#include "dapple/integrate/ray_jobs.h"

namespace dapple::light {

/// Scratch of a thread for light that comes straight from its sources (DirectLight), which does not outlive a step, and
/// what it counts.
struct LightWorkspace : integrate::RayJobs {
  integrate::RayTracer::Scratch tracing;
  integrate::RayCounts rays;
  integrate::StageCounts stages;

  int job_light[capacity];                      ///< of shadow rays; -1: to be chosen
  int counts[integrate::PointBatch::capacity];  ///< rays a point

  // What was drawn for shadow rays.
  emitters::LightSampler::Selection chosen[capacity];  ///< by job
  int drawn_count = 0;
  emitters::LightSample drawn[capacity];
  const emitters::LightSample* drawn_for[capacity];  ///< by job; null: nothing

  // Shadow rays.
  int shadow_count = 0;
  trace::RayBatch shadow;
  int shadow_point[capacity];
  uint8_t shadow_target[capacity];
  RGB shadow_light[capacity], visible[capacity];
  int shadow_source[capacity];     ///< light
  uint32_t shadow_glow[capacity];  ///< the light, if it is a medium; else no_id
  float shadow_glint[capacity];    ///< PointBatch::glint, unoccluded
  int32_t shadow_medium[capacity];
  V3f shadow_normal[capacity];  ///< of the surface that it leaves; 0 in media
};

}  // namespace dapple::light
