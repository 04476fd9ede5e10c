// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/geom/dice_rates.h"
#include "dapple/geom/displacer.h"

namespace dapple::geom {

struct Displacement {
  const Displacer* displacer = nullptr;  ///< null: the surface as it is
  float bound = infinity;                ///< heights are clamped to +- bound
};

/// Moves points along their normals by the displacer's heights. Returns how many heights had to be clamped or were no
/// number (0 then).
size_t displace(const Displacement& displacement, std::span<PatchSample> points);

/// The points on the borders of patches, each evaluated and displaced once and then used by all patches around it:
/// corners of patches, and edges at their own rate. A border sample of a patch is one of its 4 corners (0 to 3), or a
/// place inside side k.
class BorderPoints {
 public:
  static constexpr uint32_t none = ~0u;

  BorderPoints(const PatchSurface& surface, const DiceRates& rates, const Displacement& displacement);

  /// Number of a patch's border sample at place j of side k, j in [0, 2^rates.side].
  uint32_t sample(uint32_t patch, int k, uint32_t j) const;
  uint32_t sample_count(uint32_t patch) const { return first_sample_[patch + 1] - first_sample_[patch]; }

  /// The shared point of a border sample. P is displaced; uv, and N before displacement, are those of the first patch
  /// around it.
  const PatchSample& point(uint32_t patch, uint32_t sample) const {
    return points_[point_of_[first_sample_[patch] + sample]];
  }
  /// What the patch itself says where it differs from its neighbours (normals at seams, texture coordinates), else
  /// point().
  const PatchSample& own(uint32_t patch, uint32_t sample) const;
  /// True where the patch's normal is its own.
  bool on_seam(uint32_t patch, uint32_t sample) const { return on_seam_[point_of_[first_sample_[patch] + sample]]; }
  /// Where normals of a border sample are gathered from all patches that are smooth there; none: the patch is alone.
  uint32_t normal_slot(uint32_t patch, uint32_t sample) const { return slot_of_[first_sample_[patch] + sample]; }
  uint32_t slot_count() const { return slot_count_; }
  size_t clamped() const { return clamped_; }

 private:
  void number_samples();
  void assign_slots();
  void evaluate();
  uint32_t edge_point(const PatchTopology::Side& side, uint32_t j) const;

  const PatchSurface& surface_;
  const PatchTopology& topology_;
  const DiceRates& rates_;
  std::vector<uint32_t> first_edge_point_;
  std::vector<uint32_t> first_sample_;                 // of each patch
  std::vector<uint32_t> point_of_, own_of_, slot_of_;  // by border sample
  std::vector<uint8_t> on_seam_;                       // by point
  std::vector<PatchSample> points_, owns_;
  uint32_t slot_count_ = 0;
  size_t clamped_ = 0;
};

}  // namespace dapple::geom
