// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dapple/base/error.h"
#include "dapple/base/vec.h"

namespace dapple::scenefile {

/// A mesh of triangles and quads as read from a PLY file. Indices are in range; positions are finite.
struct PlyMesh {
  std::vector<V3f> P;                ///< less `base`
  V3d base{0, 0, 0};                 ///< far_points.h
  std::vector<V3f> N;                ///< empty, or one a vertex; not normalised; 0 where the file's is not finite
  std::vector<V2f> uv;               ///< empty, or one a vertex; 0 where the file's is not finite
  std::vector<int32_t> tri_indices;  ///< 3 a triangle; those of larger polygons come last
  std::vector<int32_t>
      quad_indices;  ///< 4 a quad, going round it as in the file (pbrt's bilinear patch wants 0, 1, 3, 2)
  /// The file's face_indices: empty, or one for each triangle followed by one for each quad.
  std::vector<int32_t> face_indices;
  /// Of the last vertices: which one each repeats, because its corners have other texture coordinates.
  std::vector<int32_t> repeats;
  bool many_textures = false;                                ///< faces name more than one by texnumber
  int64_t ignored_faces = 0;                                 ///< faces of fewer than 3 corners, left out
  int64_t bad_normals = 0, bad_uvs = 0, bad_corner_uvs = 0;  ///< those that were not finite
  bool has_more_data = false;                                ///< after the last element that the header announces
};

/// Reads a PLY file: ASCII or binary of either byte order, plain or gzip. Vertex properties x y z, nx ny nz, and u v
/// (also s t, texture_u texture_v, texture_s texture_t) of any number type; face properties vertex_indices (also
/// vertex_index), face_indices, and texcoord: u, v of each corner in turn, which go before those of vertices (empty:
/// the face has the vertices' own); all others are skipped. InputError at `loc`, naming the file, if it is damaged,
/// lies about its size, has indices out of range or positions that are not finite. Memory stays in proportion to the
/// file.
PlyMesh read_ply(const std::string& path, const FileLoc& loc);

/// The same from memory; `name` stands for the file in messages.
PlyMesh parse_ply(std::span<const char> data, std::string_view name, const FileLoc& loc);

}  // namespace dapple::scenefile
