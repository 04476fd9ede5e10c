// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/camera_samples.h"
#include "dapple/distribution/distribution_settings.h"

namespace dapple::distribution {

/// The hider of the REYES pipeline (Cook et al. 1987), by ray tracing: says which surfaces camera samples see, and
/// which tile of shading points serves each. Needs ShadingScene::patches.
class Hider {
 public:
  Hider(const ShadingScene& shading, const DistributionSettings& settings) : shading_(shading), settings_(settings) {}

  /// Traces one sample of each pixel. Fills `s`, except for grids, of which it knows the names (CameraSample::point).
  /// Emission goes to s.L.
  void locate(const Box2i& pixels, uint32_t sample, const PixelSets& sets, CameraSamples& s, ShadingWorkspace& w) const;

  /// The same of samples that were traced: what paths have lit is done (Source::path).
  void locate(const integrate::PathSamples& traced, CameraSamples& s, ShadingWorkspace& w) const;

  /// The same for samples [first, first + n) of a set that is spread over the whole film.
  void locate_spread(uint32_t first, int n, uint64_t set, CameraSamples& s, ShadingWorkspace& w) const;

  /// The small patches that the pixels of a block have chosen.
  struct Chosen {
    PixelPoints points;
    bool known = false;
  };
  /// Small patches, leaves say: however many of them a pixel's samples see, a few are shaded. Which, follows from the
  /// scene and the first samples, which each pass traces once more: that costs less than to keep it. Uses up `s`.
  void choose_points(const Box2i& pixels, const PixelSets& sets, Chosen& chosen, CameraSamples& s,
                     ShadingWorkspace& w) const;
  bool sees_small_patches(const CameraSamples& s) const;
  /// Replaces what samples see by what stands for it.
  void lend_points(const Chosen& chosen, CameraSamples& s) const;

  /// Names the tile of shading points that serves sample p; `finer`: than its pixel asks for, in length.
  bool dice(int p, float finer, CameraSamples& s, ShadingWorkspace& w) const;

  /// The surface is shaded at points of grids, where some tile serves it.
  bool is_gridded(uint32_t geometry) const {
    // A random choice would be made once for a shading point, however many samples see it.
    return !shading_.materials.is_random(geometry) &&
           (settings_.visible_points == VisiblePoints::grids || !shading_.is_cheap(geometry));
  }
  /// Not for paths: bodies and dear shaders, also those that no grid serves. Rays do not go through them.
  bool is_left_by_paths(uint32_t geometry) const {
    return !shading_.is_cheap(geometry) && !shading_.materials.lets_through(geometry);
  }
  /// The shader of what is seen there reads tangents for each sample, not for shading points alone.
  bool needs_tangents(uint32_t geometry) const {
    return shading_.materials.needs_tangents(geometry) && !shading_.materials.is_view_independent(geometry);
  }

 private:
  void start(CameraSamples& s) const;
  void trace(CameraSamples& s, ShadingWorkspace& w) const;
  void locate_hits(CameraSamples& s, ShadingWorkspace& w) const;

  const ShadingScene& shading_;
  const DistributionSettings& settings_;
};

}  // namespace dapple::distribution
