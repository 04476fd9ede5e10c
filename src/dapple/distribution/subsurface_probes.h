// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/scattering/bsdf.h"
#include "dapple/scattering/diffusion_profile.h"
#include "dapple/trace/ray_batch.h"

namespace dapple::distribution {

/// How the probes of one shading point sample the surface around it (King et al. 2013, "BSSRDF importance sampling"): a
/// distance by the profile of one channel, then along one of three axes whatever of the body lies within the sphere
/// that holds the profile. All axes and channels together are weighed by the balance heuristic.
class SubsurfaceProbe {
 public:
  SubsurfaceProbe() = default;  ///< black
  /// Three quarters of the probes go along the normal; below eight, each draws its axis.
  SubsurfaceProbe(const scattering::Bsdf& bsdf, int probes);

  bool is_black() const { return active_ == 0; }

  struct Chord {
    V3f offset;  ///< from the shading point to where it starts
    V3f d;       ///< unit
    float length;
  };
  /// Of probe number i. u: a pair, and one by itself.
  Chord chord(int i, const V2f& u, float u2) const;
  /// What light counts for that enters `offset` from the shading point, where the surface's normal is Ng: the profile
  /// over the expected number of probes by area.
  RGB weight(const V3f& offset, const V3f& Ng) const;
  /// Width over which the profile hardly changes, at this distance, in steps of four: probes of one body share the
  /// cache's entries of few resolutions.
  float detail(float distance) const {
    const float near = 2 * mean_;
    return distance < 2 * near ? near : distance < 8 * near ? 4 * near : 16 * near;
  }

 private:
  int count_along(int axis) const;

  Frame frame_;
  int probes_ = 0;
  int active_ = 0, channel_[3];  ///< channels that are not black
  scattering::DiffusionProfile profile_[3];
  float r_max_ = 0, smallest_ = 0, mean_ = 0;  ///< m; the mean counts channels by their reflectance
};

/// Probes under way, and what they met.
struct SubsurfaceBatch {
  static constexpr int capacity = trace::RayBatch::capacity;

  int job_count = 0;
  int point[capacity], number[capacity];  ///< by job
  uint32_t key[capacity];

  trace::RayBatch rays;
  trace::HitBatch hits;
  int job[capacity];  ///< by lane
  struct Found {
    int job;
    float u, v, nx, ny, nz, time;
    uint32_t geometry, primitive, instance;
    V3f P, Ng;
  };
  std::vector<Found> found;
};

}  // namespace dapple::distribution
