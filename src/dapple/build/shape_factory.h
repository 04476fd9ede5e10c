// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/build/dicing.h"
#include "dapple/trace/traced_scene.h"

namespace dapple::build {

/// The traced shapes of one Shape directive: none (empty), one, or two (a PLY file with triangles and quads).
/// Shapes that are displaced, and catmullclark, are diced. `to_target` takes the directive's object space to the space
/// the shapes are wanted in. Throws InputError; with context.keep_going a missing or broken mesh file becomes a warning
/// and a stand-in cube at the origin of its space. Thread-safe for different entities.
std::vector<trace::Shape> make_shapes(const BuildContext& context, const scenefile::ShapeEntity& entity,
                                      const Transform& to_target, const Dicing& dicing = {});

}  // namespace dapple::build
