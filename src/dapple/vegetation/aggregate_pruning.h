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
/// Components are gathered by the tree of their Morton codes. A cluster becomes one of its components, drawn by area
/// and scaled about its centre to the area of all, wherever this is no larger than `pixels` of the narrowest pixel at
/// any of them, and no cluster around it may. So kept sets are nested: what a coarser level keeps, a finer one keeps
/// too. Long components are scaled across alone, and it is their width that counts. Large components, and clusters that
/// are solid, stay. Normals, texture coordinates and source faces go with their faces. Nothing depends on threads.
bool prune(geom::Mesh* mesh, const geom::DicingView& view, float pixels, PruningCounts* counts);

}  // namespace dapple::vegetation
