// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "dapple/geom/control_cage.h"

namespace dapple::geom {

/// How the faces of a cage fall into quad patches, and which edges and corners these share. A quad is one patch; a face
/// of n != 4 corners is n patches, patch i from its corner i to the middles of the edges there and to the centre of the
/// face. A patch's (0, 0) is its first corner; u runs along the face's edge from there.
struct PatchTopology {
  static constexpr uint32_t none = ~0u;

  /// A side of a patch, in the direction of growing u or v. It covers an edge (part 0) or its first or second half (1,
  /// 2).
  struct Side {
    uint32_t edge;
    uint8_t part;
    bool reversed;
  };
  struct Patch {
    uint32_t face, sub;
    uint32_t corner[4];  ///< at (0, 0), (1, 0), (1, 1), (0, 1)
    Side side[4];        ///< v = 0, u = 1, v = 1, u = 0
  };
  struct Edge {
    uint32_t vertex[2];
    uint32_t middle = none;  ///< vertex half way, where a face beside the edge is no quad
    bool seam = false;       ///< normals differ across it: sharp creases, and edges of more than two faces or of faces
                             ///< turned against each other
  };

  std::vector<Patch> patches;  ///< by face, then by corner
  std::vector<Edge> edges;
  std::vector<uint8_t> seam_vertex;    ///< a seam ends or turns there
  std::vector<uint32_t> first_patch;   ///< of each face, and the number of patches at the end: holes have none
  std::vector<uint32_t> face_numbers;  ///< as ControlCage's; never empty
  std::vector<uint32_t> sub_numbers;   ///< likewise; may be empty

  /// `cage` is clean.
  explicit PatchTopology(const ControlCage& cage);

  size_t face_count() const { return first_patch.size() - 1; }
  size_t vertex_count() const { return seam_vertex.size(); }
  /// Corners at the start and the end of a side.
  static constexpr int side_corners[4][2] = {{0, 1}, {1, 2}, {3, 2}, {0, 3}};
};

}  // namespace dapple::geom
