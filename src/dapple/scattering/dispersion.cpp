// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/dispersion.h"

#include <algorithm>
#include <array>

#include "dapple/numeric/spectrum.h"

namespace dapple::scattering {

namespace {

// Fraunhofer's lines, um.
constexpr float line_d = 0.5876f, line_F = 0.4861f, line_C = 0.6563f;

float inverse_square(float x) {
  return 1 / (x * x);
}

// Of each channel, wavelengths at equal steps of u.
constexpr int steps = 256;
using Quantiles = std::array<std::array<float, steps + 1>, 3>;

Quantiles find_quantiles() {
  constexpr int count = visible_max - visible_min + 1;
  const SampledSpectrum d65 = daylight(6500);
  Quantiles out;
  for (int c = 0; c < 3; ++c) {
    std::array<double, count + 1> below{};  // a nanometre from each wavelength on
    for (int i = 0; i < count; ++i) {
      XYZ xyz = colour_matching(visible_min + i);
      const double light = d65(visible_min + i);
      xyz.x *= light, xyz.y *= light, xyz.z *= light;
      below[size_t(i) + 1] = below[size_t(i)] + std::max(double(xyz_to_rgb(xyz)[c]), 0.0);
    }
    size_t i = 0;
    for (int n = 0; n <= steps; ++n) {
      const double wanted = below[count] * n / steps;
      while (i + 1 < count && below[i + 1] < wanted) ++i;
      const double width = below[i + 1] - below[i];
      out[size_t(c)][size_t(n)] = float(visible_min - 0.5 + double(i) + (width > 0 ? (wanted - below[i]) / width : 0));
    }
  }
  return out;
}

}  // namespace

float cauchy_coefficient(float ior, float abbe) {
  return (ior - 1) / (abbe * (inverse_square(line_F) - inverse_square(line_C)));
}

float ior_at(float ior, float cauchy, float wavelength) {
  const float n = ior + cauchy * (inverse_square(wavelength / 1000) - inverse_square(line_d));
  return ior >= 1 ? std::max(n, 1.0f) : n;
}

float wavelength_of(int channel, float u) {
  static const Quantiles quantiles = find_quantiles();
  const float at = u * steps;
  const int i = std::clamp(int(at), 0, steps - 1);
  const auto& q = quantiles[size_t(channel)];
  return q[size_t(i)] + (at - float(i)) * (q[size_t(i) + 1] - q[size_t(i)]);
}

}  // namespace dapple::scattering
