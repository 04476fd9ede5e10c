// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/trace/ray_batch.h"

namespace dapple::trace {

/// The rays of a batch on their way through a scene that is repeated without end along x and y, cell by cell: those
/// that are still under way, each as its segment in the one cell that there is. Use: measure(), trace `segments`,
/// go_on(), until none is left or max_cells are passed.
class CellWalk {
 public:
  /// Ends rays that run level between what there is; a path over this many cells has lost all its light long before.
  static constexpr int max_cells = 4096;

  /// bounds: of all that is in the cell.
  CellWalk(const RayBatch& rays, int n, const Box2f& cell, const Box3f& bounds);

  /// Ends each ray's segment where it leaves its cell. A little beyond, so that nothing slips through between two
  /// cells.
  void measure();
  /// Takes the rays i for which wanted[i] holds to their next cells; the others end.
  void go_on(const bool* wanted);

  int count = 0;
  int ray[RayBatch::capacity];        ///< number in the batch
  double passed[RayBatch::capacity];  ///< distance to the segment's origin
  RayBatch segments;

 private:
  float into(float x, int axis) const;
  float to_border(float o, float d, int axis) const;
  void keep(const bool* wanted);

  const Box2f cell_;
  const Box3f bounds_;
  float left_[RayBatch::capacity], length_[RayBatch::capacity];
  bool along_x_[RayBatch::capacity];
};

}  // namespace dapple::trace
