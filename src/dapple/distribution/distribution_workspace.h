// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/grid_finder.h"
#include "dapple/distribution/grid_shader.h"
#include "dapple/distribution/sample_finisher.h"

namespace dapple::distribution {

/// What a thread needs for distribution ray tracing: the scratch of each part.
struct DistributionWorkspace final : integrate::Integrator::Workspace {
  explicit DistributionWorkspace(int groups) : shading(groups), camera(groups), finisher(groups) {}

  PixelSets sets{1, 0};  ///< of the work at hand
  ShadingWorkspace shading;
  CameraSamples camera;
  // Camera samples that need no grids, where paths light these; null: nowhere.
  std::unique_ptr<integrate::Integrator::Workspace> paths;
  std::unique_ptr<integrate::PathSamples> path_samples;
  Hider::Chosen chosen;
  GridFinder::Scratch finder;
  ClaimedPoints claimed;
  GridShader::Scratch grids;
  SampleFinisher::Scratch finisher;

  void begin_block() {
    chosen.known = false;
    finder.begin_block();
  }
};

}  // namespace dapple::distribution
