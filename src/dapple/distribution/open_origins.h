// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/shading_scene.h"

namespace dapple::distribution {

/// Leaves light and diffuse rays of cells to those of their origins that readers of the cell see. Behind a picture on a
/// wall, under a rug, between a cupboard and a wall a cell is dark, and no ray that reads it ends there: counted in the
/// mean, such places make its visible part too dark.
class OpenOrigins {
 public:
  explicit OpenOrigins(const ShadingScene& shading) : tracer_(shading.scene, shading.materials, false) {}

  /// Of each point of the batch for which wanted[k], cells of patches: an origin stays where a ray straight away from
  /// it goes CacheNumbers::open_widths of the cell's width freely, and else with the probability with which one by the
  /// cosine does, as rays of readers come by reciprocity. The others are replaced by copies of those that stay; where
  /// none does, all stay.
  void keep(integrate::PointBatch& b, const bool* wanted, ShadingWorkspace& w) const;

 private:
  static void replace_closed(uint32_t open, int k, integrate::PointBatch& b);
  void trace(int first, int end, integrate::PointBatch& b, const bool* wanted, ShadingWorkspace& w) const;

  const integrate::RayTracer tracer_;  ///< air is in nobody's way
};

}  // namespace dapple::distribution
