// SPDX-License-Identifier: Apache-2.0
#include "dapple/scattering/dispersion.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "dapple/numeric/spectrum.h"
#include "dapple/scattering/principled_layers.h"

namespace dapple::scattering {
namespace {

TEST(Dispersion, HasTheAbbeNumberThatWasAskedFor) {
  for (const auto& [ior, abbe] : {std::pair(1.5f, 20.0f), {1.5168f, 64.2f}, {2.42f, 55.0f}}) {
    const float b = cauchy_coefficient(ior, abbe);
    EXPECT_FLOAT_EQ(ior_at(ior, b, 587.6f), ior);
    EXPECT_NEAR((ior - 1) / (ior_at(ior, b, 486.1f) - ior_at(ior, b, 656.3f)), abbe, .01f * abbe);
  }
  EXPECT_EQ(ior_at(1.01f, cauchy_coefficient(1.01f, .1f), 800), 1);  // never below air
}

// Means of wavelength, and the share below some of them, are those of the sensitivities.
TEST(Dispersion, WavelengthsFollowTheSensitivities) {
  const SampledSpectrum d65 = daylight(6500);
  for (int c = 0; c < 3; ++c) {
    const auto weight = [&](double l) {
      XYZ xyz = colour_matching(l);
      const double light = d65(l);
      xyz.x *= light, xyz.y *= light, xyz.z *= light;
      return std::max(double(xyz_to_rgb(xyz)[c]), 0.0);
    };
    for (const double limit : {450.0, 500.0, 550.0, 600.0, 650.0, 831.0}) {
      double below = 0, all = 0;
      for (double l = 360; l <= 830; l += .25) all += weight(l), below += l < limit ? weight(l) : 0;
      constexpr int n = 20000;
      int found = 0;
      for (int i = 0; i < n; ++i) found += double(wavelength_of(c, (float(i) + .5f) / n)) < limit;
      EXPECT_NEAR(double(found) / n, below / all, .006) << "channel " << c << " below " << limit;
    }
  }
}

TEST(Dispersion, IsOfWhatIsClear) {
  PrincipledLayers p;
  p.dispersion = .01f;
  EXPECT_EQ(p.bsdf().dispersion, 0);
  p.transmission = .5f;
  EXPECT_EQ(p.bsdf().dispersion, .01f);
  p.thin_walled = true;
  EXPECT_EQ(p.bsdf().dispersion, 0);
  p.thin_walled = false;
  Bsdf b = p.bsdf();
  b.disperse(450);
  EXPECT_GT(b.ior, p.ior);
  EXPECT_EQ(b.dispersion, 0);
}

}  // namespace
}  // namespace dapple::scattering
