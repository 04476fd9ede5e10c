// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/claimed_points.h"
#include "dapple/distribution/distribution_settings.h"
#include "dapple/distribution/hit_shader.h"
#include "dapple/distribution/irradiance_interpolator.h"

namespace dapple::distribution {

/// Shades points of grids, in full batches. A point is a pure function of its grid's name, and of where the camera is.
class GridShader {
 public:
  /// `interpolator`: null where each point sends diffuse rays of its own.
  GridShader(const ShadingScene& shading, const PointPlacer& placer, const HitShader& shader,
             const IrradianceInterpolator* interpolator, const DistributionSettings& settings)
      : shading_(shading), placer_(placer), shader_(shader), interpolator_(interpolator), settings_(settings) {}

  struct Scratch {
    std::unique_ptr<IrradianceInterpolator::Workspace> interpolation;  ///< null without an interpolator
    // Where the points of the batch under way belong.
    struct Target {
      ShadingGrid* grid;
      int index;
    } target[integrate::PointBatch::capacity];
    trace::RayBatch seen_ray;
    trace::HitBatch seen_hits;
    double seconds = 0;  ///< that it took so far
  };

  /// Shades claimed points, until no more than so many are left.
  void shade(int left, ClaimedPoints& claimed, Scratch& scratch, ShadingWorkspace& w) const;

  /// Writes the inputs of point k of a batch: a point of a grid.
  void set_point(const ShadingGrid& grid, int point, integrate::PointBatch& b, int k, Scratch& scratch,
                 ShadingWorkspace& w) const {
    set_point(seen_grid(grid, scratch, w), point % grid.id.width(), point / grid.id.width(), b, k, w);
  }

 private:
  struct Shares {
    int rays = 1, diffuse = 1;  ///< PointBatch::share and crowd
  };
  /// What the points of a grid have in common.
  struct SeenGrid {
    scene::GridId id;
    scene::PatchTable::Cell cell;
    Shares shares;
    const gi::TileLinks& links;
  };
  void add_points(ShadingGrid& grid, ShadingGrid::Parts points, integrate::PointBatch& b, Scratch& scratch,
                  ShadingWorkspace& w) const;
  void shade_batch(Scratch& scratch, ShadingWorkspace& w) const;
  SeenGrid seen_grid(const ShadingGrid& grid, Scratch& scratch, ShadingWorkspace& w) const;
  void set_point(const SeenGrid& grid, int i, int j, integrate::PointBatch& b, int k, ShadingWorkspace& w) const;
  int finest_step(const scene::PatchTable::Cell& cell, const V3f& P) const;
  scene::GridId patches_seen(const scene::GridId& grid, Scratch& scratch) const;
  Shares shared_work(const scene::GridId& grid, Scratch& scratch, ShadingWorkspace& w) const;
  int points_in_pixel(const scene::GridId& grid, Scratch& scratch, ShadingWorkspace& w) const;

  const ShadingScene& shading_;
  const PointPlacer& placer_;
  const HitShader& shader_;
  const IrradianceInterpolator* const interpolator_;
  const DistributionSettings& settings_;
};

}  // namespace dapple::distribution
