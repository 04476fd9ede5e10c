// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/base/error.h"
#include "dapple/scenefile/scene_description.h"

namespace dapple::build {

/// What is taken off positions, in double precision, before anything becomes float. World positions of a built scene
/// are those of its file less `scene`; those in the space of an object definition less its own, which the transforms of
/// its instances give back.
struct Origins {
  V3d scene{0, 0, 0};
  std::vector<V3d> objects;  ///< by definition

  /// Of something in the world: T(-scene) M.
  Transform in_world(const Transform& m) const { return scene == V3d(0, 0, 0) ? m : Transform::translate(-scene) * m; }
  scenefile::TransformPair in_world(const scenefile::TransformPair& m) const {
    return {in_world(m.start), in_world(m.end)};
  }
  /// Of an instance of a definition: T(-scene) M T(its own).
  scenefile::TransformPair of_instance(const scenefile::InstanceEntity& instance) const;
};

/// M T(base), for points that are less a base; M itself without one.
Transform with_base(const Transform& m, const V3d& base);

/// Option "point3 origin", or the middle of the bounds of all shapes, rounded to a grid of a power of two of 4 to 8
/// times their extent; 0 where it is nearer than 16 extents, or nearer than both 256 and 4096 extents. Mesh files are
/// judged by their first 64 KiB. The origin of an object definition is found alike, and 0 where an instance of it turns
/// while the shutter is open. Warns once where floats are too coarse for what is left.
Origins find_origins(const scenefile::SceneDescription& description, Diagnostics& diagnostics);

/// The rule of it, of a box: least corner, greatest corner.
V3d origin_of(const Imath::Box3d& bounds);
/// Bounds of the points of a shape in its own space, before its transform; of a file those of its head.
Imath::Box3d estimated_bounds(const scenefile::SceneDescription& description, const scenefile::ShapeEntity& entity);
/// True if only the translation changes while the shutter is open.
bool only_translates(const scenefile::TransformPair& pair);

}  // namespace dapple::build
