// SPDX-License-Identifier: Apache-2.0
#include "dapple/numeric/conductor_rgb.h"

#include <gtest/gtest.h>

#include <cmath>

#include "dapple/base/vec.h"
#include "dapple/numeric/fresnel.h"
#include "dapple/numeric/named_spectra.h"

namespace dapple {
namespace {

struct Metal {
  SampledSpectrum eta, k;
  explicit Metal(const std::string& name)
      : eta(*find_named_spectrum(name + "-eta")), k(*find_named_spectrum(name + "-k")) {}
};

RGB fresnel(const ConductorRgb& c, float cos_theta) {
  RGB out;
  for (int i = 0; i < 3; ++i) out[i] = fresnel_conductor(cos_theta, c.eta[i], c.k[i]);
  return out;
}

const char* const metals[] = {"metal-Ag", "metal-Al", "metal-Au", "metal-Cu", "metal-CuZn", "metal-MgO", "metal-TiO2"};

// The promise of conductor_rgb.h, at angles between those that were fitted too.
TEST(ConductorRgb, MatchesTheSpectralMetalAtEveryAngle) {
  for (const char* name : metals) {
    const Metal m(name);
    const ConductorRgb c = conductor_to_rgb(m.eta, m.k);
    const float tolerance = std::string(name) == "metal-Au" ? 0.01f : 0.005f;  // the red of gold is out of range
    for (int degrees = 0; degrees <= 85; ++degrees) {
      const float cos_theta = std::cos(static_cast<float>(degrees) * pi / 180);
      const RGB want = clamp(conductor_reflectance(m.eta, m.k, cos_theta), 0, 1), have = fresnel(c, cos_theta);
      for (int i = 0; i < 3; ++i)
        EXPECT_NEAR(have[i], want[i], degrees == 0 ? 1.1e-4f : tolerance)
            << name << ", " << degrees << " degrees, channel " << i;
    }
  }
}

TEST(ConductorRgb, SameIndicesEverywhereComeBack) {
  const ConductorRgb c = conductor_to_rgb(SampledSpectrum::constant(0.3f), SampledSpectrum::constant(3.2f));
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(c.eta[i], 0.3f, 2e-3f);
    EXPECT_NEAR(c.k[i], 3.2f, 1e-2f);
  }
  // With a coat of index 1.5 around it.
  const ConductorRgb coated = conductor_to_rgb(SampledSpectrum::constant(0.3f), SampledSpectrum::constant(3.2f), 1.5f);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(coated.eta[i], 0.2f, 2e-3f);
    EXPECT_NEAR(coated.k[i], 3.2f / 1.5f, 1e-2f);
  }
}

// Colours of metals as everyone knows them, and why eta and k are not averaged instead.
TEST(ConductorRgb, BeatsAveragedIndices) {
  const Metal copper("metal-Cu");
  const RGB right = conductor_reflectance(copper.eta, copper.k, 1);
  EXPECT_GT(right.r, 0.9f);
  EXPECT_NEAR(right.g, 0.63f, 0.03f);
  EXPECT_NEAR(right.b, 0.53f, 0.03f);
  const RGB n = unbounded_to_rgb(copper.eta), k = unbounded_to_rgb(copper.k);
  const RGB averaged = fresnel({n, k}, 1), fitted = fresnel(conductor_to_rgb(copper.eta, copper.k), 1);
  EXPECT_GT(std::abs(averaged.r - right.r), 0.01f);
  EXPECT_LT(std::abs(fitted.r - right.r), 1e-4f);
}

TEST(ConductorRgb, ExtremeSpectraStayFinite) {
  for (const float n : {0.0f, 1e-3f, 1.0f, 100.0f})
    for (const float k : {0.0f, 1e-3f, 1.0f, 1e4f}) {
      const ConductorRgb c = conductor_to_rgb(SampledSpectrum::constant(n), SampledSpectrum::constant(k));
      EXPECT_TRUE(c.eta.is_finite() && c.k.is_finite()) << n << " " << k;
      EXPECT_TRUE(c.eta.min() > 0 && c.k.min() >= 0) << n << " " << k;
    }
}

TEST(ConductorRgb, FromReflectance) {
  const RGB r(0.9f, 0.5f, 0.05f);
  const RGB have = fresnel(conductor_from_reflectance(r), 1);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(have[i], r[i], 1e-5f);
}

}  // namespace
}  // namespace dapple
