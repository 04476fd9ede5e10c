// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "dapple/geom/dicing_view.h"
#include "dapple/geom/mesh.h"

namespace dapple::vegetation {

/// What pruning looked at, and what it left.
struct PruningCounts {
  size_t components = 0, kept = 0;  ///< of meshes that are aggregates
  size_t faces = 0, faces_kept = 0;
  size_t bytes = 0, bytes_kept = 0;  ///< of these meshes, without what is built over them

  PruningCounts& operator+=(const PruningCounts& o) {
    components += o.components, kept += o.kept, faces += o.faces, faces_kept += o.faces_kept, bytes += o.bytes,
        bytes_kept += o.bytes_kept;
    return *this;
  }
};

/// Stochastic pruning of aggregate detail (Cook, Halstead, Planck and Ryu, "Stochastic simplification of aggregate
/// detail", 2007), once for a mesh: of many small connected components, as leaves and twigs are, that are much smaller
/// than a pixel of `view`, a few are kept and stand for the others. False where the mesh stays as it is.
///
/// Components are sorted by Morton code; the nodes of the tree of codes are clusters. A cluster may be merged if one of
/// its components, drawn by area and scaled about its centre to the area of all, is no larger than `pixels` times the
/// narrowest pixel at any of them. The largest clusters that may be merged are. The draw doesn't depend on `pixels`, so
/// what a coarser level keeps, a finer one keeps too. Long components are scaled across alone, until they are as wide
/// as long, and it is their width that counts. Large components, and clusters that are solid (bricks, cobbles), stay.
/// Where vertices move, the larger size and the narrower pixel of both ends of the shutter count. Normals, texture
/// coordinates and source faces go with their faces. Nothing depends on threads.
bool prune(geom::Mesh* mesh, const geom::DicingView& view, float pixels, PruningCounts* counts);

}  // namespace dapple::vegetation
