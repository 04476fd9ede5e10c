// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/grid_store.h"
#include "dapple/integrate/camera_paths.h"
#include "dapple/integrate/light_sums.h"
#include "dapple/integrate/ray_tracer.h"

namespace dapple::distribution {

/// What serves a camera sample: nothing that is to be shaded, points of a grid, its own hit, or a path that has lit it.
enum class Source : uint8_t { nothing, grid, hit, path };

constexpr int sample_level = 0;  ///< of camera samples in the recursion, and of grids

/// A camera sample whose ray has met something.
struct CameraSample {
  V2i pixel;
  float film_weight;
  uint32_t seed, index;  ///< CameraBatch
  float time, spread;    ///< of its ray
  float width;           ///< of the pixel's footprint where it met something, m
  V3f d;
  RGB passed;
  int32_t medium;
  uint32_t geometry;
  geom::SurfacePoint surface;

  Source source = Source::nothing;
  bool refined;  ///< its grid is finer than its pixel asks for
  uint32_t held;
  ShadingGrid* grid;  ///< GridFinder::Scratch::held
  scene::GridPoint point;
  scene::PatchTable::Neighbours near;  ///< on the grid
  ShadingGrid::Parts wanted;           ///< of the grid

  // Of a path, where that is the source.
  RGB direct;
  scene::Features features;

  bool is_ready() const {
    return source == Source::nothing || source == Source::path || (source == Source::grid && grid->has(wanted));
  }
};

/// One camera sample of each pixel of a block, what their rays met, and the light that they have so far.
struct CameraSamples {
  static constexpr int capacity = integrate::CameraBatch::capacity;

  explicit CameraSamples(int groups) : L(groups) {}

  integrate::CameraBatch camera;
  trace::RayBatch rays;
  trace::HitBatch hits;
  integrate::RayTracer::Flights flights;
  float distance[capacity];
  int32_t medium[capacity];
  RGB passed[capacity];
  integrate::LightSums L;
  CameraSample sample[capacity];

  int count() const { return camera.count; }
};

}  // namespace dapple::distribution
