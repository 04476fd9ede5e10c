// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "dapple/geom/mesh.h"

namespace dapple::geom {

/// The patches of a mesh: pieces of surface over the unit square (s, t), by which shading is shared. A quad is a patch;
/// two consecutive triangles with a common edge and like normals are one, a triangle alone is the half s >= t of one.
/// Patch numbers follow the faces, so they are stable from frame to frame.
class PatchMap {
 public:
  struct PatchPoint {
    uint32_t patch;
    float s, t;
  };
  struct FacePoint {
    uint32_t face;
    float u, v;
  };

  explicit PatchMap(const Mesh& mesh);

  uint32_t patch_count() const { return patch_count_; }
  /// Only s >= t belongs to the patch.
  bool is_half(uint32_t patch) const { return !patches_.empty() && !patches_[patch].paired; }
  PatchPoint patch_point(uint32_t face, float u, float v) const {
    if (patches_.empty()) return {face, u, v};
    const uint32_t number = patch_of_face_[face];
    const Patch& patch = patches_[number];
    const float b[3] = {1 - u - v, u, v};
    const bool first = patch.face == face;
    const uint32_t a = first ? patch.rotation : patch.rotation2;
    const float b1 = b[after[a]], b2 = b[after[a + 1]];
    // (b1 + b2, b2) on the first, (b1, b1 + b2) on the second: which, is a coin toss, so there is no branch.
    return {number, b1 + b2 * float(first), b2 + b1 * float(!first)};
  }
  /// Where (0,0), (1,0), (1,1) and (0,1) are; a half has no fourth corner.
  void corners_at(const Mesh& mesh, uint32_t patch, float time, V3f out[4]) const;
  /// Inverse of patch_point; both are affine on each side of the diagonal.
  FacePoint face_point(uint32_t patch, float s, float t) const;

 private:
  /// Corners are a, b, c, d at (0,0), (1,0), (1,1), (0,1); the diagonal is ac.
  struct Patch {
    uint32_t face;          ///< abc; acd is the following one
    uint8_t rotation = 0;   ///< corner of `face` that is a
    uint8_t rotation2 = 0;  ///< corner of the following face that is a
    bool paired = false;
  };
  static constexpr uint8_t after[4] = {1, 2, 0, 1};  ///< corners of a triangle, by one
  static bool pair(const Mesh& mesh, uint32_t face, Patch* out);

  uint32_t patch_count_;
  std::vector<uint32_t> patch_of_face_;  ///< empty for quads: patches are faces
  std::vector<Patch> patches_;
};

}  // namespace dapple::geom
