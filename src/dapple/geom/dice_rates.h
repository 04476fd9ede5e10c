// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "dapple/geom/dicing_view.h"
#include "dapple/geom/patch_surface.h"

namespace dapple::geom {

/// Into how many pieces edges and patches are cut, as powers of two. An edge's rate is its own, the same for all
/// patches beside it; a patch is cut at least as finely as its sides.
struct DiceRates {
  static constexpr int max_level = 12;

  std::vector<uint8_t> edge;                  ///< log2 of the pieces of each edge
  std::vector<std::array<uint8_t, 2>> patch;  ///< log2 of the cells along u and v
  int coarsened = 0;                          ///< levels taken off everywhere

  /// Cells of about `shading_rate` pixels (area) as `view` sees the surface before displacement; coarsened until there
  /// are at most max_vertices.
  DiceRates(const PatchSurface& surface, const DicingView& view, float shading_rate, size_t max_vertices);

  /// Takes `levels`, in all, off what the view asks for; everywhere alike, so that an edge's rate stays its own.
  void coarsen(const PatchTopology& topology, int levels);

  int side(const PatchTopology::Side& s) const { return edge[s.edge] - (s.part != 0); }
  size_t vertex_count() const;

 private:
  std::vector<uint8_t> wanted_;                 // of edges
  std::vector<std::array<uint8_t, 2>> middle_;  // what the middle lines of patches want
};

}  // namespace dapple::geom
