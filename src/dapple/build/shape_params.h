// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "dapple/build/build_context.h"
#include "dapple/geom/mesh.h"
#include "dapple/scenefile/obj_reader.h"
#include "dapple/scenefile/ply_reader.h"

namespace dapple::build {

/// What the readers of Shape directives share. All throw InputError.
void check_indices(const scenefile::ShapeEntity& entity, const char* name, std::span<const int32_t> indices,
                   size_t vertices);
/// A list by vertex has none or as many values as there are vertices.
void check_count(const scenefile::ShapeEntity& entity, const char* name, size_t count, size_t vertices);
/// The corners of each face by "faceverts", which add up to `corners`; without it all have `usual`.
std::vector<uint32_t> face_sizes(const scenefile::ShapeEntity& entity, size_t corners, uint32_t usual);

/// Read with warnings of what in the file is left out; one of each kind a file.
scenefile::PlyMesh read_ply(const BuildContext& context, const scenefile::ShapeEntity& entity, const std::string& path);
scenefile::ObjMesh read_obj(const BuildContext& context, const scenefile::ShapeEntity& entity, const std::string& path);

/// What is missing of a shape that has turned out to have no face.
std::string why_no_face(const scenefile::ShapeEntity& entity);

std::vector<V3f> points3(std::span<const float> numbers);
/// The points of "P1" less the base of "P".
std::vector<V3f> points_at_close(const scenefile::ShapeEntity& entity);
std::vector<V2f> points2(std::span<const float> numbers);

/// What takes the place of a mesh file that cannot be read: a cube of side 1 around the origin.
geom::Mesh stand_in_cube();

}  // namespace dapple::build
