// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

#include "dapple/geom/patch_clusters.h"
#include "dapple/geom/patch_map.h"
#include "dapple/trace/traced_scene.h"

namespace dapple::scene {

/// How a shape is cut into patches.
struct ShapePatches {
  std::shared_ptr<const geom::PatchMap> map;            ///< meshes only
  std::shared_ptr<const geom::PatchClusters> clusters;  ///< meshes of many faces, and grids
};

/// Cuts shapes into patches, and knows it when they are asked for again: by another integrator, or in a scene that took
/// them over (trace::TracedScene). A function of the shape alone. Thread-safe.
class PatchMemory {
 public:
  /// Of all shapes of a scene, by geometry. Shapes of other scenes are forgotten.
  std::vector<ShapePatches> of(const trace::TracedScene& scene);

 private:
  struct Known {
    trace::Shape shape;  ///< so that no other comes to lie in its place
    ShapePatches patches;
  };
  std::mutex mutex_;
  std::unordered_map<const void*, Known> known_;  ///< by where the shape is
};

}  // namespace dapple::scene
