// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "dapple/base/rgb.h"

namespace dapple {
inline namespace numeric {

/// An RGB colour space: CIE 1931 xy of its primaries and its white.
struct RgbPrimaries {
  std::array<double, 2> red, green, blue, white;
};

inline constexpr RgbPrimaries rec709_primaries = {
    {0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}, {0.3127, 0.3290}};  ///< also sRGB
inline constexpr RgbPrimaries rec2020_primaries = {{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, {0.3127, 0.3290}};
/// With the white of displays, D65, as in pbrt-v4; not the one of cinema projectors.
inline constexpr RgbPrimaries dci_p3_primaries = {{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, {0.3127, 0.3290}};
inline constexpr RgbPrimaries aces2065_1_primaries = {{0.7347, 0.2653}, {0, 1}, {0.0001, -0.0770}, {0.32168, 0.33767}};

/// A linear map of RGB.
struct RgbMatrix {
  double m[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};  ///< [row][column]

  RGB operator()(RGB c) const;
};

/// What becomes of the white of the other space.
enum class White {
  keep,  ///< the same light: a space of another white looks tinted; right for lights
  adapt  ///< (1, 1, 1) stays (1, 1, 1), by Bradford's chromatic adaptation; right for reflectances
};

/// From linear RGB of a space to that of Rec.709.
RgbMatrix rgb_to_rec709(const RgbPrimaries& from, White white);

/// Of linear Rec.709: light of this chromaticity (CIE xy) becomes white, by Bradford's chromatic adaptation.
RgbMatrix white_balance(const std::array<double, 2>& from);

/// From linear RGB to CIE XYZ, Y = 1 for (1, 1, 1).
RgbMatrix rgb_to_xyz(const RgbPrimaries& from);

}  // namespace numeric
}  // namespace dapple
