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

/// The polygons of an OBJ file. Indices are in range; numbers are finite; faces have 3 corners or more.
struct ObjMesh {
  std::vector<V3f> P;                ///< less `base`
  V3d base{0, 0, 0};                 ///< far_points.h
  std::vector<V2f> uv;               ///< empty if no face has texture coordinates
  std::vector<uint32_t> face_sizes;  ///< corners of each face
  std::vector<uint32_t> indices;     ///< into P, by corner
  std::vector<uint32_t> uv_indices;  ///< into uv, by corner; empty where uv is. Corners without coordinates have (0, 0)
  int64_t ignored_faces = 0;         ///< faces of fewer than 3 corners, left out
  const char* doubt = nullptr;       ///< why the file may be no OBJ file; null if nothing tells
};

/// Reads the v, vt and f lines of an OBJ file (plain or gzip), as one mesh; all others (groups, materials, normals,
/// curves) are skipped. InputError at `loc`, naming the file and line, if it is damaged. Memory stays in proportion to
/// the file.
ObjMesh read_obj(const std::string& path, const FileLoc& loc);

/// The same from memory; `name` stands for the file in messages.
ObjMesh parse_obj(std::string_view data, std::string_view name, const FileLoc& loc);

}  // namespace dapple::scenefile
