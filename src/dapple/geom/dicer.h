// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/geom/border_points.h"
#include "dapple/geom/grid_mesh.h"

namespace dapple::geom {

struct DiceSettings {
  float shading_rate = 1;  ///< area of a micropolygon in pixels
  Displacement displacement;
  size_t max_vertices = size_t(1) << 25;  ///< of the whole surface; it is diced more coarsely if it would have more
};

struct DiceReport {
  int coarsened = 0;   ///< levels taken off everywhere, as DiceRates has it
  size_t clamped = 0;  ///< heights beyond the displacement bound, or no number
};

/// Dices a surface into grids of micropolygons (Cook, Carpenter and Catmull 1987) of about shading_rate pixels as
/// `view` sees it before displacement, 2^a x 2^b cells a patch. Grids hold at most 256 x 256 cells: finer patches
/// become tiles.
///
/// There are no cracks: a point on an edge that patches share is evaluated and displaced once, at the edge's own rate.
/// Where a patch is finer than its edge, its further vertices there are moved to the nearest of the edge's, not only
/// onto the straight line between them: between vertices that lie on a line but for rounding, one ray in about 10^7
/// would pass.
///
/// Normals: the surface's, or where it is displaced the sum of area vectors of the cells around, over all patches that
/// are smooth there.
GridMesh dice(const PatchSurface& surface, const DicingView& view, const DiceSettings& settings, DiceReport* report);
/// The same at rates that are settled already.
GridMesh dice(const PatchSurface& surface, const DiceRates& rates, const Displacement& displacement,
              DiceReport* report);

}  // namespace dapple::geom
