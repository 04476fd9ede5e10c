// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "dapple/geom/mesh.h"
#include "dapple/scenefile/scene_description.h"

namespace dapple::build {

/// What the readers of Shape directives share. All throw InputError.
void check_indices(const scenefile::ShapeEntity& entity, const char* name, std::span<const int32_t> indices,
                   size_t vertices);
/// A list by vertex has none or as many values as there are vertices.
void check_count(const scenefile::ShapeEntity& entity, const char* name, size_t count, size_t vertices);

std::vector<V3f> points3(std::span<const float> numbers);
std::vector<V2f> points2(std::span<const float> numbers);

/// What takes the place of a mesh file that cannot be read: a cube of side 1 around the origin.
geom::Mesh stand_in_cube();

}  // namespace dapple::build
