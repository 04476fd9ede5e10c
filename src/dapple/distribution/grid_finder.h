// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/claimed_points.h"
#include "dapple/distribution/hider.h"

namespace dapple::distribution {

/// Finds the grids that camera samples see in the store, links those that are new, and says which of their points serve
/// each sample.
class GridFinder {
 public:
  GridFinder(const ShadingScene& shading, const Hider& hider, const DistributionSettings& settings, GridStore& store)
      : shading_(shading), hider_(hider), settings_(settings), store_(store) {}

  /// The grids that samples of a block see.
  struct Scratch {
    std::vector<GridStore::GridPtr> held;  ///< so that the store may drop them
    static constexpr int found_count = 512;
    uint32_t found[found_count] = {};  ///< index in `held` + 1 by the names of grids; 0: none
    int order[CameraSamples::capacity];
    integrate::CacheCounts counts;

    void begin_block() {
      held.clear();
      std::fill_n(found, found_count, 0u);
    }
  };

  /// Finds the points of all samples that grids serve, and claims what nobody has shaded.
  void find_points(CameraSamples& s, Scratch& scratch, ClaimedPoints& claimed, ShadingWorkspace& w) const;
  /// The grids of all such samples alone.
  void find_grids(CameraSamples& s, Scratch& scratch, ShadingWorkspace& w) const;

 private:
  int list_grids(const CameraSamples& s, Scratch& scratch) const;
  int find_first(int n, CameraSamples& s, Scratch& scratch, int* cuts, ShadingWorkspace& w) const;
  void refine(int* cuts, int cut, CameraSamples& s, Scratch& scratch, ShadingWorkspace& w) const;
  bool restrict_points(CameraSample& s) const;
  void find(int n, CameraSamples& s, Scratch& scratch, ShadingWorkspace& w) const;

  const ShadingScene& shading_;
  const Hider& hider_;
  const DistributionSettings& settings_;
  GridStore& store_;
};

}  // namespace dapple::distribution
