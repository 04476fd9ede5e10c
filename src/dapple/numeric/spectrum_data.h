// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>

namespace dapple {
inline namespace numeric {

// Published tables behind spectrum.h and named_spectra.h; each source file names its sources.
namespace spectrum_data {

/// CIE 1931 2-degree colour matching functions, 360 to 830 nm by 5 nm.
inline constexpr int cmf_count = 95;
extern const double cmf_x[cmf_count], cmf_y[cmf_count], cmf_z[cmf_count];

/// Components of daylight, 300 to 830 nm by 10 nm: S0, S1, S2 of CIE 15, table T.2.
inline constexpr int daylight_count = 54;
extern const float daylight_s0[daylight_count], daylight_s1[daylight_count], daylight_s2[daylight_count];

/// CIE illuminants F1 to F12, 380 to 780 nm by 5 nm.
inline constexpr int fluorescent_count = 81;
extern const float fluorescent[12][fluorescent_count];

/// n^2 = 1 + sum of b_i L^2 / (L^2 - c_i), L in micrometres.
struct Glass {
  std::string_view name;
  double b[3], c[3];
};
std::span<const Glass> glasses();

/// Rows of wavelength (nm), n, k.
struct Metal {
  std::string_view name;
  std::span<const float[3]> rows;
};
std::span<const Metal> metals();

}  // namespace spectrum_data
}  // namespace numeric
}  // namespace dapple
