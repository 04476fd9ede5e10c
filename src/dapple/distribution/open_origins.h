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

  /// Of each point of the batch for which wanted[k], cells of patches: an origin stays with the probability with which
  /// a ray that comes from there by the cosine, as readers do by reciprocity, goes CacheNumbers::open_widths of the
  /// cell's width freely. The others are replaced by copies of those that stay; where none does, all stay.
  void keep(integrate::PointBatch& b, const bool* wanted, ShadingWorkspace& w) const;

 private:
  void trace(int first, int end, integrate::PointBatch& b, const bool* wanted, ShadingWorkspace& w) const;

  const integrate::RayTracer tracer_;  ///< air is in nobody's way
};

}  // namespace dapple::distribution
