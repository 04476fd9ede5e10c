// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/integrate/point_batch.h"
#include "dapple/numeric/sobol.h"
#include "dapple/shading/light_sampler.h"

namespace dapple::light {

/// Scratch of a thread for light that comes straight from its sources (DirectLight), which does not outlive a step, and
/// what it counts.
struct LightWorkspace {
  static constexpr int capacity = integrate::RaySet::capacity;

  integrate::RayTracer::Scratch tracing;
  integrate::RayCounts rays;
  integrate::StageCounts stages;

  // Rays about to be drawn, and their random numbers.
  int job_count = 0;
  int job_point[capacity];
  int job_light[capacity];     ///< -1: to be chosen
  float job_weight[capacity];  ///< 1 / number of rays of this kind
  alignas(64) uint32_t seed[capacity], index[capacity];
  alignas(64) float u0[capacity], u1[capacity], u2[capacity];
  int counts[integrate::PointBatch::capacity];  ///< rays a point

  // What was drawn for shadow rays.
  shading::LightSampler::Selection chosen[capacity];  ///< by job
  int drawn_count = 0;
  shading::LightSample drawn[capacity];
  const shading::LightSample* drawn_for[capacity];  ///< by job; null: nothing

  // Shadow rays.
  int shadow_count = 0;
  trace::RayBatch shadow;
  int shadow_point[capacity];
  uint8_t shadow_target[capacity];
  RGB shadow_light[capacity], visible[capacity];
  int shadow_source[capacity];   ///< light
  float shadow_glint[capacity];  ///< PointBatch::glint, unoccluded
  int32_t shadow_medium[capacity];
  V3f shadow_normal[capacity];  ///< of the surface that it leaves; 0 in media

  /// Three random numbers for each of the first n seeds and indices: a pair, and one by itself.
  void draw_samples(int n) {
    sample_2d(seed, index, 0, n, u0, u1);
    sample_1d(seed, index, 1, n, u2);
  }
};

}  // namespace dapple::light
