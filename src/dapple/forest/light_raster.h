// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "dapple/forest/canopy_mask.h"
#include "dapple/forest/sky_dome.h"
#include "dapple/forest/sun_disc.h"

namespace dapple::forest {

/// Columns [x0, x0 + width) and rows [y0, y0 + height).
struct Window {
  int x0 = 0, y0 = 0, width = 0, height = 0;
};

/// Sun or sky in tangent-plane coordinates (illumination under trees, 3.1): cell (x, y) holds what of the light reaches
/// a receiver from the directions (u, v, 1) with u / cell in [x - 1/2, x + 1/2] and -v / cell likewise about y: rows
/// run downwards as those of a mask do. Weighted by the receiver's cosine: cells are irradiances, W m^-2, and for a
/// mask of pitch `cell` times its height they are the w of
///   E(g) = sum over x of m(x) w(x - g).
struct LightRaster {
  Window window;
  Raster weight;  ///< width, height of the window
  int stride =
      1;  ///< odd: each cell stands for stride x stride cells of that pitch, and its light is spread evenly over them
};

/// Integrals of a density, already times the receiver's cosine, over cells by Gauss's rule of 2 x 2 nodes, cells
/// quartered until they are small against the distance to the zenith and `detail` (radians): relative error below 1e-5
/// for the smooth skies. grey: one channel.
LightRaster sky_raster(const DirectionDensity& density, double detail, bool grey, double cell, const Window& window);

/// The sun's disc on cells of size `cell`, as much of it as lies in `limit`; the irradiance of the open horizontal
/// plane is kept exactly where all of it does.
LightRaster sun_raster(const SunDisc& sun, double cell, const Window& limit);

/// Where the sun's disc lies, with a margin: columns and rows of cells.
Window sun_window(const SunDisc& sun, double cell);

/// Light of a raster on a grid that repeats after width and height cells; its stride is 1.
LightRaster folded(const LightRaster& raster, int width, int height);

}  // namespace dapple::forest
