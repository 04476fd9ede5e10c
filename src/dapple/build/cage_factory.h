// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/build/build_context.h"
#include "dapple/geom/control_cage.h"
#include "dapple/geom/mesh.h"

namespace dapple::build {

/// The cage of a catmullclark directive, from its own numbers or its mesh file, in object space less `base`. Throws
/// InputError.
geom::ControlCage catmull_clark_cage(const BuildContext& context, const scenefile::ShapeEntity& entity, V3d* base);
/// The cage of a loopsubdiv directive: triangles, into which larger polygons of "faceverts" are cut. Throws InputError.
geom::ControlCage loop_cage(const BuildContext& context, const scenefile::ShapeEntity& entity);
/// Meshes over the same vertices (or one mesh) as polygons, welded.
geom::ControlCage polygon_cage(std::vector<geom::Mesh> meshes);

}  // namespace dapple::build
