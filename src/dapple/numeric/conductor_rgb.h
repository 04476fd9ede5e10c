// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/base/rgb.h"
#include "dapple/numeric/spectrum.h"

namespace dapple {
inline namespace numeric {

/// A metal for an RGB renderer: each channel has its own complex index eta + i k.
struct ConductorRgb {
  RGB eta, k;
};

/// Indices such that fresnel_conductor() per channel gives the colour that the spectral metal has under D65.
///
/// Averaging eta and k over wavelength, as is often done, gives wrong colours, since reflectance is far from linear in
/// them. Here Fresnel reflectance is integrated over the spectrum first, at a set of angles, and converted to RGB. For
/// a channel, let R0 be that reflectance at normal incidence; the pairs (eta, k) that give R0 exactly form a curve, k^2
/// = (R0 (eta + 1)^2 - (eta - 1)^2) / (1 - R0), and on it the eta that fits the other angles best (least squares over 0
/// to 85 degrees by 2.5) is found by a search.
///
/// Error, for every named metal: none at normal incidence, below 0.005 in each channel up to 85 degrees
/// (conductor_rgb_test.cpp), after channels beyond [0, 0.9999] are clamped to that range, for an RGB renderer must not
/// create energy. That happens to the red of gold, 1.038, which is just outside Rec.709; there the error reaches 0.01.
///
/// `outer_index` is that of the medium around the metal (the coat's); the spectra are relative to vacuum.
ConductorRgb conductor_to_rgb(const SampledSpectrum& eta, const SampledSpectrum& k, float outer_index = 1);

/// Colour under D65 of the spectral metal at an angle of incidence: what conductor_to_rgb() fits. Not clamped.
RGB conductor_reflectance(const SampledSpectrum& eta, const SampledSpectrum& k, double cos_theta,
                          float outer_index = 1);

/// pbrt-v4's conductor of a given normal reflectance: eta = 1, k = 2 sqrt(r / (1 - r)) per channel, r at most 0.9999.
ConductorRgb conductor_from_reflectance(RGB reflectance);

}  // namespace numeric
}  // namespace dapple
