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
/// Of a primitive of a mesh or grid, the area that u and v in [0, 1] span, by Embree's normal there; 0 of others.
float parameter_area(const Shape& shape, uint32_t primitive, const V3f& normal);
/// Equal, bit for bit: rays meet one as they meet the other.
bool same_shape(const Shape& a, const Shape& b);

}  // namespace dapple::trace
