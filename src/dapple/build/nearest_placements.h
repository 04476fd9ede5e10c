// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/build/build_context.h"
#include "dapple/build/camera_view.h"

namespace dapple::build {

/// World from object space, as a scene is built, for objects that stand in objects or are placed by files: of each
/// definition that is `wanted` those places, InstancesView::most_placements at most, whose pixels are the smallest in
/// units of the object, anywhere in the ball about its `bounds`, or where its origin lies if it has none. Empty for
/// others, and of plain instances in the scene. Bounds are in the definition's space, as in the file.
///
/// Found best first: all within a block of placements lies in a ball, which tells the smallest pixel there can be. Each
/// file is read once to make these balls, and of what lies in a nearer ball than the places found so far again. Warns,
/// once, where there is so much to look at that some was left.
std::vector<std::vector<Transform>> nearest_placements(const BuildContext& context, const std::vector<uint8_t>& wanted,
                                                       const CameraView& view,
                                                       const std::vector<Imath::Box3d>& bounds = {});

}  // namespace dapple::build
