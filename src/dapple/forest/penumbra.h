// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>

#include "dapple/forest/light_raster.h"

namespace dapple::forest {

/// A sheet of leaves `height` metres above the ground.
struct CanopyPlane {
  CanopyMask mask;
  double height = 1;
};

/// How several sheets are taken together: light through them all is no chain of correlations (illumination under
/// trees, 3.3).
enum class Planes {
  independent,  ///< the product of each sheet's share of the open irradiance, sun and sky apart: right for leaves that
                ///< know nothing of each other
  merged        ///< one sheet of all transmittances multiplied, at the height weighted by their opacities
};

/// Fourier transforms done for one correlation: of rasters of nx by ny numbers.
struct TransformCount {
  int nx = 0, ny = 0, forward = 0, inverse = 0;
};

struct PenumbraSettings {
  Planes planes = Planes::independent;
  /// Cells of the sky's raster, at most this part of the height (and half the sky's detail): the mask is averaged to
  /// them and their irradiance interpolated, with an error of some 1e-4 of the open irradiance at 1/64. 0: cells of the
  /// mask.
  double sky_cell = 1.0 / 64;
  size_t max_bytes = size_t{8} << 30;                 ///< of spectra; MemoryError above
  std::vector<TransformCount>* transforms = nullptr;  ///< if set, what was done is added
};

/// Irradiance of the ground under sheets of leaves by the correlation of sun and sky with them (Max 1991; illumination
/// under trees, 3.2):
///   E(g) = sum over x of m(x) w(x - g),
/// exact, but for rounding, for masks constant over their pixels and receivers under the middles of pixels. A mask that
/// does not repeat enters as its opacity, and whatever passes beside it arrives whole: nothing of the sky is cut off.
/// One that repeats is correlated with the light folded to its size; of the sky, what comes from more than 8 heights
/// aside (and 1.5 times the mask) sees its mean. Results are rasters of W m^-2 on the pixels of the mask, in colour if
/// mask or light are. std::invalid_argument for heights that are not positive.
Raster sun_irradiance(const CanopyMask& mask, double height, const SunDisc& sun, const PenumbraSettings& settings = {});
Raster sky_irradiance(const CanopyMask& mask, double height, const SkyDome& sky, const PenumbraSettings& settings = {});
/// Sun and sky, either of them, under one or several sheets of equal size and pixels. Always in colour.
Raster ground_irradiance(std::span<const CanopyPlane> planes, const std::optional<SunDisc>& sun,
                         const std::optional<SkyDome>& sky, const PenumbraSettings& settings = {});

/// Skylight under a mask for receivers of any orientation: the nine real spherical harmonics up to degree 2 of the
/// light that arrives at each pixel, from which irradiance follows by the cosine's coefficients (Ramamoorthi and
/// Hanrahan 2001): within some 3 % of the open sky's irradiance.
class OrientedSkylight {
 public:
  OrientedSkylight(const CanopyMask& mask, double height, const SkyDome& sky, const PenumbraSettings& settings = {});
  /// On the side of a surface that the unit normal n points to, W m^-2.
  RGB irradiance(int x, int y, const V3f& n) const;

 private:
  std::array<Raster, 9> harmonics_;
};

/// The sun's irradiance on a surface of normal n where it is `horizontal` on the ground: its disc is small against the
/// cosine.
RGB oriented_sunlight(const RGB& horizontal, const SunDisc& sun, const V3f& n);

/// c(g) = sum over x of f(x) w(x - g) for g in `out`, channel by channel; f is zero outside, or repeats. By Fourier
/// transforms.
Raster correlate(const Raster& f, const LightRaster& w, bool periodic, const Window& out,
                 const PenumbraSettings& settings);

}  // namespace dapple::forest
