// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/build/build_context.h"
#include "dapple/trace/traced_scene.h"

namespace dapple::build {

/// Shape "disks": from "point3 P", "normal N" and "float radius" (one, or one a disk), or from a file
/// (scenefile/disk_table.h). Null if there are none. Throws InputError, also where the transform would make ellipses of
/// them.
trace::DisksPtr make_disks(const BuildContext& context, const scenefile::ShapeEntity& entity,
                           const Transform& to_target);

}  // namespace dapple::build
