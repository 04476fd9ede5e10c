// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/shading_place.h"
#include "dapple/distribution/shading_workspace.h"

namespace dapple::distribution {

/// The way from rays back to shaders: what gathers light calls it, a batch at a time, for what its rays met. It reads
/// the inputs of the batch at place.level.
class PointShader {
 public:
  /// All lobes; writes b.Ci.
  virtual void shade(const Place& place, ShadingWorkspace& w) const = 0;
  /// Diffuse light alone; writes b.diffuse.
  virtual void shade_diffuse(const Place& place, ShadingWorkspace& w) const = 0;
  /// Points in media; writes b.Ci.
  virtual void shade_media(const Place& place, ShadingWorkspace& w) const = 0;

 protected:
  ~PointShader() = default;
};

}  // namespace dapple::distribution
