// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/integrate/point_batch.h"
#include "dapple/numeric/sobol.h"

namespace dapple::integrate {

/// Rays of all kinds that are about to be drawn from points of a batch, and their random numbers: a set at a time.
struct RayJobs {
  static constexpr int capacity = RaySet::capacity;

  int job_count = 0;
  int job_point[capacity];
  float job_weight[capacity];  ///< 1 / number of rays of this kind
  alignas(64) uint32_t seed[capacity], index[capacity];
  alignas(64) float u0[capacity], u1[capacity], u2[capacity];

  /// Three random numbers for each of the first n seeds and indices: a pair, and one by itself.
  void draw_samples(int n) {
    sample_2d(seed, index, 0, n, u0, u1);
    sample_1d(seed, index, 1, n, u2);
  }
};

}  // namespace dapple::integrate
