// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/geom/curve_set.h"
#include "dapple/scenefile/scene_description.h"
#include "dapple/trace/traced_scene.h"

namespace dapple::build {

/// Shape "curve" as cubic Bezier segments: any of pbrt's bases and degrees. Throws InputError. Fibres, whose material
/// knows what is inside, are ribbons that face all rays where they would be tubes: what passes them must not meet them
/// again.
trace::CurvesPtr make_curve(const scenefile::ShapeEntity& entity, const Transform& to_target, bool is_fibre = false);

}  // namespace dapple::build
