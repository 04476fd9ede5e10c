// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/integrate/camera_batch.h"
#include "dapple/integrate/distribution_integrator.h"
#include "dapple/integrate/pixel_points.h"

namespace dapple::integrate {

/// What serves a camera sample: nothing that is to be shaded, points of a grid, or its own hit.
enum class Source : uint8_t { nothing, grid, hit };

constexpr int sample_level = 0;  ///< of camera samples in the recursion, and of grids

/// What this thread has to link or to shade.
struct Claimed {
  ShadingGrid* grid;
  ShadingGrid::Parts parts;
};

/// What a thread needs for distribution ray tracing.
struct DistributionWorkspace final : Integrator::Workspace {
  static constexpr int capacity = CameraBatch::capacity;

  explicit DistributionWorkspace(int groups = 0) : shading(groups), L(groups) {}

  CameraBatch camera;
  ShadingWorkspace shading;
  std::unique_ptr<IrradianceInterpolator::Workspace> interpolation;
  bool wants_features = false;

  // By camera sample.
  trace::RayBatch camera_rays;
  trace::HitBatch hits;
  RayTracer::Flights flights;
  float distance[capacity], width[capacity];
  int32_t medium[capacity];
  RGB passed[capacity];
  LightSums L;
  scene::Features features[capacity];
  geom::SurfacePoint surface[capacity];
  Source source[capacity];
  scene::GridPoint point[capacity];
  ShadingGrid* grid[capacity];
  std::vector<GridStore::GridPtr> held;  ///< those grids, so that the store may drop them
  scene::PatchTable::Neighbours near[capacity];  ///< on the grid
  bool refined[capacity];                        ///< the grid is finer than its pixel asks for
  std::vector<Claimed> claimed;  ///< what this thread has to link or to shade
  int order[capacity];
  static constexpr int found_count = 512;
  uint16_t found[found_count];  ///< samples + 1 by the hash of their grids; 0: none
  trace::RayBatch seen_ray;

  PixelPoints seen;
  bool seen_known = false;

  // Where the points of the batch under way belong.
  struct Target {
    ShadingGrid* grid;
    int index;
  } target[capacity];
};

}  // namespace dapple::integrate
