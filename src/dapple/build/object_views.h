// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "dapple/build/build_context.h"
#include "dapple/build/camera_view.h"

namespace dapple::build {

/// Of which ends of their motion instances count.
enum class MotionEnds { open, both };

/// Of each definition that holds shapes which are `wanted`, what the camera sees of it through its instances in the
/// scene and in objects, and the placements of files. Null for others, and where there is none. Which of many are the
/// nearest goes by scene_origin.h's estimated_bounds() of these shapes.
std::vector<std::shared_ptr<const geom::DicingView>> object_views(
    const BuildContext& context, const std::shared_ptr<const CameraView>& camera,
    const std::function<bool(const scenefile::ShapeEntity&)>& wanted, MotionEnds ends);

}  // namespace dapple::build
