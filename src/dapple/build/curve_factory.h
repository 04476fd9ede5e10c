// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/geom/curve_set.h"
#include "dapple/scenefile/scene_description.h"
#include "dapple/trace/traced_scene.h"

namespace dapple::build {

/// Shape "curve" as cubic Bezier segments: any of pbrt's bases and degrees. Throws InputError.
trace::CurvesPtr make_curve(const scenefile::ShapeEntity& entity, const Transform& to_target);

}  // namespace dapple::build
