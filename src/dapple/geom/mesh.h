// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "dapple/base/vec.h"
#include "dapple/geom/surface_point.h"

namespace dapple::geom {

/// Triangles or quads over shared vertices. Quads list corners around the face, (u, v) = (0,0), (1,0), (1,1), (0,1).
/// Immutable once built.
struct Mesh {
  int corners = 3;  ///< vertices a face: 3 or 4
  std::vector<V3f> P;
  std::vector<V3f> P_end;  ///< positions at shutter close; empty = the mesh does not deform
  std::vector<V3f> N;      ///< shading normals at vertices, may be empty
  std::vector<V2f> uv;     ///< at vertices, may be empty
  std::vector<uint32_t> indices;
  std::vector<uint32_t>
      source_face;    ///< face of the scene file that each face came from (face_indices, diced patches); may be empty
  bool flip = false;  ///< without N, outside is the other side than the corners' order says

  size_t face_count() const { return indices.size() / size_t(corners); }
  size_t bytes() const;
  /// Corner positions of a face at a time of the shutter interval [0, 1].
  void corners_at(uint32_t face, float time, V3f out[4]) const;
  /// u, v: barycentric (b1, b2) of a triangle, or quad coordinates, as Embree reports them. dPdu to dNdv are set if
  /// `tangents`.
  SurfacePoint at(uint32_t face, float u, float v, float time, bool tangents = true) const;
  /// The texture coordinates that at() gives, for meshes that have them, and the area of the parallelogram that u and v
  /// in [0, 1] span in their plane.
  V2f uv_at(uint32_t face, float u, float v, float* area) const;
};

}  // namespace dapple::geom
