// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "dapple/base/error.h"
#include "dapple/base/rgb.h"

namespace dapple {
inline namespace numeric {

// Spectra, and how they become the RGB (linear, Rec.709 primaries, D65 white) that Dapple renders with.
//
// Spectra exist while a scene is built only. What a spectrum is of decides its conversion.
//
// - Emission: integrals over the CIE 1931 2-degree observer, divided by that of Y: a chromaticity at luminance 1. The
//   default sensor of pbrt-v4's film sees the same of a light, since pbrt-v4 divides every light's spectrum by its
//   photometric integral before `scale`.
// - Reflectance: integrals under D65, each channel divided by that of a perfect reflector: constant 1 becomes white.
// - Other (index of refraction, absorption): averages with the same weights, so a constant c becomes (c, c, c).
//
// Chromaticities beyond Rec.709 come out with a negative channel; see each function for what becomes of it.

/// Piecewise-linear function of wavelength (nm).
class SampledSpectrum {
 public:
  /// Throws std::invalid_argument unless there are as many values as wavelengths, at least one, all finite, wavelengths
  /// positive and increasing.
  SampledSpectrum(std::vector<float> wavelengths, std::vector<float> values);
  static SampledSpectrum constant(float value);

  const std::vector<float>& wavelengths() const { return wavelengths_; }
  const std::vector<float>& values() const { return values_; }
  /// Beyond the ends, the value at the end: measurements rarely cover all that the observer sees.
  double operator()(double wavelength) const;
  float min() const;
  float max() const;

 private:
  std::vector<float> wavelengths_, values_;
};

struct XYZ {
  double x = 0, y = 0, z = 0;
};

/// Range of the colour matching functions, nm.
inline constexpr int visible_min = 360, visible_max = 830;

/// Colour matching functions of the CIE 1931 2-degree observer; zero outside their range. From the table at 5 nm by
/// cubic interpolation.
XYZ colour_matching(double wavelength);
/// Integral of colour_matching().y over wavelength, nm.
inline constexpr double cie_y_integral = 106.857;

/// Integrals of spectrum times colour matching functions over wavelength (nm), the spectrum zero beyond its ends. Exact
/// for the piecewise-linear functions involved, so narrow lines are not missed.
XYZ integrate_xyz(const SampledSpectrum& spectrum);

/// Linear Rec.709 of XYZ; (0.95046, 1, 1.08906), the white of chromaticity (0.3127, 0.3290), becomes (1, 1, 1).
RGB xyz_to_rgb(const XYZ& xyz);

/// Colour of a light at luminance 1. Colours beyond Rec.709 lose their negative channels and keep the luminance. Zero
/// where the spectrum has no visible part.
RGB emission_to_rgb(const SampledSpectrum& spectrum);
/// Colour of a surface under D65. Not clamped.
RGB reflectance_to_rgb(const SampledSpectrum& spectrum);
/// Averages of any other quantity, with the weights of reflectance_to_rgb. Not clamped.
RGB unbounded_to_rgb(const SampledSpectrum& spectrum);

/// Radiance of a black body (Planck), W m^-2 sr^-1 m^-1 (per metre of wavelength). kelvin > 0.
double planck(double wavelength, double kelvin);
/// Spectrum of a black body over the visible range, scaled to a maximum of 1 there, for any kelvin > 0
/// (std::invalid_argument).
SampledSpectrum blackbody(double kelvin);
/// Daylight of a correlated colour temperature (CIE 15, 4000 to 25000 K): D65 is 6500 K. `kelvin` is nominal: it is
/// scaled by 1.4388 / 1.4380, as CIE illuminants are, for the second radiation constant has changed since they were
/// named. 100 at 560 nm.
SampledSpectrum daylight(double kelvin);

/// Reads "wavelength value" pairs separated by white space or commas; # begins a comment. Throws InputError, at a line
/// of `name`, for anything else, unordered or non-positive wavelengths, values that are not finite, no values.
SampledSpectrum parse_spectrum(std::string_view text, const std::string& name);
/// The same from a file of at most 4 MiB. A file that cannot be read is an InputError at `loc`.
SampledSpectrum read_spectrum_file(const std::string& path, const FileLoc& loc);

}  // namespace numeric
}  // namespace dapple
