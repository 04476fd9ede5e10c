// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "dapple/distribution/subsurface_probes.h"
#include "dapple/gi/cache_batch.h"
#include "dapple/gi/cache_log.h"
#include "dapple/integrate/material_table.h"
#include "dapple/light/light_workspace.h"
#include "dapple/light/surface_media.h"

namespace dapple::distribution {

/// What a thread found out lately about tiles: whether a source of light is near. A pure function of the tile, so
/// forgetting changes nothing.
struct NearLights {
  struct Known {
    scene::GridId tile{.geometry = trace::no_id};
    bool near = false;
  };
  Known& of(const scene::GridId& tile) { return known_[tile.slot() % known_count]; }

 private:
  static constexpr int known_count = 4096;
  Known known_[known_count];
};

/// Scratch of a thread that does not outlive a step, and the batches of its recursion.
struct ShadingWorkspace : light::LightWorkspace {
  explicit ShadingWorkspace(int light_groups = 0) : groups(light_groups) {}

  const int groups;  ///< of lights, whose parts are kept apart

  integrate::MaterialTable::Scratch prelighting;
  gi::TileLinker::Scratch linking;
  std::unique_ptr<light::SurfaceMedia::Scratch> surface_media;  ///< null until it is needed
  pattern::ShadingPoints points;                                ///< for stages that shaders have of their own
  gi::RadiosityCache::Counts caches, irradiance_caches;
  double fill_seconds = 0;  ///< of all fills so far
  NearLights near_lights;
  scene::PatchTable::Extents extents;
  gi::CacheLog* cache_log = nullptr;  ///< of the entries that visible surfaces read; null: none is kept
  RGB passed[capacity];

  integrate::PointBatch& level(int depth) {
    while (int(levels.size()) <= depth) levels.push_back(std::make_unique<integrate::PointBatch>(groups));
    return *levels[size_t(depth)];
  }
  gi::CacheBatch& cache_level(int depth) {
    while (int(cache_levels.size()) <= depth) cache_levels.push_back(std::make_unique<gi::CacheBatch>(groups));
    return *cache_levels[size_t(depth)];
  }
  SubsurfaceBatch& subsurface_level(int depth) {
    while (int(subsurface_levels.size()) <= depth) subsurface_levels.push_back(nullptr);
    auto& level = subsurface_levels[size_t(depth)];
    if (!level) level = std::make_unique<SubsurfaceBatch>();
    return *level;
  }

 private:
  std::vector<std::unique_ptr<integrate::PointBatch>> levels;
  std::vector<std::unique_ptr<gi::CacheBatch>> cache_levels;
  std::vector<std::unique_ptr<SubsurfaceBatch>> subsurface_levels;
};

}  // namespace dapple::distribution
