// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/rgb.h"

namespace dapple::scattering {

/// A clear film of even thickness between two media, none of which absorbs: Airy's sum over all reflections in it,
/// averaged over what the observer sees under D65 (numeric/spectrum.h). Of real amplitudes a and b at its two sides
///
///   R(phase) = 1 - (1 - a^2) (1 - b^2) / (1 - a^2 b^2) (1 + 2 sum_m (-a b)^m cos(m phase)),
///
/// so that the average needs the cosine transform of each channel's sensitivity alone (the way of Belcour and Barla
/// 2017, "A practical extension to microfacet theory for the modeling of varying iridescence", who fit it by Gaussians;
/// here it is tabulated). Both polarisations; indices do not vary with wavelength.
struct ThinFilm {
  float thickness = 0;  ///< nm, from 0 upwards
  float ior = 1.4f;     ///< all indices at least 1
  float outer = 1;      ///< index above

  /// Over media of these indices, one for each channel, for light that meets the film at an angle of this cosine in a
  /// vacuum. In [0, 1].
  RGB reflectance(float cosine, const RGB& base) const;
  /// reflectance() less that of no thickness, Fresnel's: 0 at thickness 0.
  RGB change(float cosine, const RGB& base) const;
};

/// Mean of cos(2 pi path / wavelength) over each channel's sensitivity; path in nm, from 0 upwards. 0 beyond 16,000.
/// Error below .002.
RGB mean_fringe(float path);

}  // namespace dapple::scattering
