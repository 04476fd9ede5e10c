// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <variant>

#include "dapple/geom/curve_set.h"
#include "dapple/geom/disk_cloud.h"
#include "dapple/geom/grid_mesh.h"
#include "dapple/geom/mesh.h"
#include "dapple/geom/quadric.h"

namespace dapple::trace {

using MeshPtr = std::shared_ptr<const geom::Mesh>;
using QuadricPtr = std::shared_ptr<const geom::Quadric>;
using CurvesPtr = std::shared_ptr<const geom::CurveSet>;
using GridsPtr = std::shared_ptr<const geom::GridMesh>;
using DisksPtr = std::shared_ptr<const geom::DiskCloud>;
using Shape = std::variant<MeshPtr, QuadricPtr, CurvesPtr, GridsPtr, DisksPtr>;

/// World space, whatever moves at shutter open. Bezier curves: of their control points with radii.
Box3f bounds_of(const Shape& shape);

}  // namespace dapple::trace
