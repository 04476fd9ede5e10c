// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "dapple/geom/mesh.h"

namespace dapple::geom {

/// Loop subdivision of a triangle mesh by OpenSubdiv: `levels` uniform refinements, then vertices moved to the limit
/// surface with limit normals. Boundaries are smooth curves. faces * 4^levels must fit a 32-bit index; callers bound it
/// by memory. Throws std::invalid_argument for topology that cannot be refined.
Mesh subdivide_loop(std::span<const V3f> P, std::span<const uint32_t> triangles, int levels);

}  // namespace dapple::geom
