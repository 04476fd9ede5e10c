// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/shafts/haze.h"
#include "dapple/shafts/view_ray.h"

namespace dapple::shafts {

/// What AirLight computes otherwise for a lamp than for parallel light. Light is that a radian of the angle psi at the
/// lamp, over sigma_s, of a lamp of intensity 1.
class LampLight {
 public:
  /// The planes, to a lamp, must outlive it.
  LampLight(const ScanPlanes& planes, const Haze& haze);

  /// How near the ray comes to the lamp, and where. off: of parallel rays, of their origins from the eye.
  void set_distance(const V3f& off, ViewRay* view) const;
  /// The ray's ends as angles, after that.
  void place(ViewRay* view) const;
  /// Of `n` blocks from `first` on; what is dark and lit.
  void find_states(const ViewRay& view, int first, int n, BlockStates* states) const;
  void find_nodes(const ViewRay& view, int first, BlockNodes* nodes) const;
  /// Of a block; rays of light are lit up to a distance of -blocked from the lamp.
  void cut_bins(const ViewRay& view, int block, LitBins* lit) const;
  /// Adds a block bin by bin, by the midpoint rule.
  void add_steep_bins(const ViewRay& view, int block, LightSums* sums) const;
  /// The column from the lamp to P.
  float entry_of(const V3f& P) const;

 private:
  const ScanPlanes& planes_;
  const Haze haze_;
  int channels_;       // 1: all alike
  float at_lamp_ = 1;  // density there
};

}  // namespace dapple::shafts
