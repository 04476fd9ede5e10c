// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "dapple/base/vec.h"

namespace dapple::geom {

enum class SurfaceScheme {
  polygons,       ///< the faces themselves: quads are bilinear
  catmull_clark,  ///< any faces (Catmull and Clark 1978; creases after DeRose et al. 1998)
  loop            ///< triangles (Loop 1987)
};

/// What a subdivision surface does at the border of its cage.
enum class BoundaryRule {
  none,            ///< faces at the border have no surface
  edge_only,       ///< the border becomes a smooth curve
  edge_and_corner  ///< likewise, but vertices of a single face stay corners
};

/// A mesh of polygons that stands for a surface. Indices are in range, positions finite.
struct ControlCage {
  SurfaceScheme scheme = SurfaceScheme::catmull_clark;
  BoundaryRule boundary = BoundaryRule::edge_and_corner;
  std::vector<V3f> P;
  std::vector<V3f> P_end;  ///< positions at shutter close; empty = still
  std::vector<V3f> N;  ///< polygons only: at vertices, on the outside; empty = averaged over the faces around a vertex
  std::vector<V3f> N_end;               ///< likewise, at shutter close
  std::vector<V2f> uv;                  ///< texture coordinates; empty = those of the patches
  std::vector<uint32_t> uv_indices;     ///< into uv, a corner of a face each; empty = uv has one a vertex
  std::vector<uint32_t> face_sizes;     ///< corners of each face
  std::vector<uint32_t> indices;        ///< vertices of all faces, counter-clockwise from outside
  std::vector<uint32_t> crease_edges;   ///< pairs of vertices
  std::vector<float> crease_sharpness;  ///< an edge each; 10 and above is a sharp crease
  std::vector<uint32_t> corners;
  std::vector<float> corner_sharpness;
  std::vector<uint32_t> holes;         ///< faces that shape their neighbours but are not part of the surface
  bool flip = false;                   ///< without N, outside is the other side than the corners' order says
  std::vector<uint32_t> face_numbers;  ///< of the faces left by clean(): what they were before; empty = 0, 1, 2, ...
  std::vector<uint32_t> sub_numbers;   ///< of the faces made by split(): which part of a face they are; empty = 0

  size_t face_count() const { return face_sizes.size(); }
  /// Makes vertices at one position one vertex, so that faces meet where files keep copies; texture coordinates become
  /// those of corners, normals are summed.
  void weld();
  /// Leaves out what has no surface or would take time without bound: faces of fewer than 3 or more than max_corners
  /// corners, or that meet a vertex twice (once corners that follow on themselves are joined), or around vertices of
  /// more than max_corners faces (for Loop subdivision also those that are no triangles), and creases that are no edge.
  /// Returns a sentence for each kind.
  std::vector<std::string> clean();

  /// Polygons only: fills N and N_end. Normals that are given decide about `flip`, on the whole.
  void complete_normals();
  /// Polygons only: cuts every face into quads (from each corner to the middles of its edges and the centre), and these
  /// again, while there are at most `max_faces` <= 1024: so that rates can differ within a face. The surface stays the
  /// same.
  void split(size_t max_faces);

  static constexpr uint32_t max_corners = 256;  ///< evaluation takes time by its square

 private:
  void join_repeated_corners();
  void split_once();
};

}  // namespace dapple::geom
