// SPDX-License-Identifier: Apache-2.0
#include "dapple/numeric/half_space.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "dapple/base/hash.h"
#include "dapple/numeric/fresnel.h"

namespace dapple {
namespace {

/// The cosine with the direction before, of Henyey and Greenstein's function.
double scattering_cosine(double g, double u) {
  if (std::abs(g) < 1e-6) return 1 - 2 * u;
  const double s = (1 - g * g) / (1 - g + 2 * g * u);
  return (1 + g * g - s * s) / (2 * g);
}

// Share of photons, of those that enter at the cosine `outside`, that leave again: a walk that knows nothing of
// ordinates.
double walk_from(double outside, double albedo, double eta, double g, KeyedRng* rng) {
  double mu = std::sqrt(1 - (1 - outside * outside) / (eta * eta)), z = 0, weight = 1, sum = 0;
  while (weight > 1e-4) {
    const double t = -std::log1p(-double(rng->next()));
    if (mu < 0 && z + t * mu <= 0) {
      const double inside = fresnel_dielectric(-mu, 1 / eta);
      sum += weight * (1 - inside);
      weight *= inside;
      z = 0, mu = -mu;
      continue;
    }
    z += t * mu;
    weight *= albedo;
    const double c = scattering_cosine(g, double(rng->next())), phi = 2 * std::numbers::pi * double(rng->next());
    mu = std::clamp(mu * c + std::sqrt((1 - mu * mu) * (1 - c * c)) * std::cos(phi), -1.0, 1.0);
  }
  return sum;
}

// Rationale: two independent computations. Expected: equal within four standard errors (a photon's weight varies by
// less than .5).
TEST(HalfSpace, AgreesWithMonteCarlo) {
  constexpr int photons = 60000;
  for (const double g : {0.0, 0.7, -0.4})
    for (const double eta : {1.0, 1.33, 1.5, 0.8})
      for (const double albedo : {0.3, 0.8, 0.95}) {
        KeyedRng rng(hash(uint64_t(albedo * 100), uint64_t(eta * 100), uint64_t((g + 1) * 100)));
        double sum = 0;
        for (int i = 0; i < photons; ++i) {
          double outside;
          do outside = std::sqrt(double(rng.next()));
          while (rng.next() < fresnel_dielectric(outside, eta));
          sum += walk_from(outside, albedo, eta, g, &rng);
        }
        EXPECT_NEAR(half_space_reflectance(albedo, eta, g), sum / photons, 4 * 0.5 / std::sqrt(photons))
            << albedo << ", index " << eta << ", g " << g;
      }
}

// Rationale: of light from one direction, too, a flat body sends back what the walk does. Expected: within four
// standard errors, found by the spread of the photons, and 1 % for the fit.
TEST(HalfSpace, AgreesWithMonteCarloByDirection) {
  constexpr int photons = 60000;
  for (const double g : {0.0, 0.7})
    for (const double eta : {1.0, 1.33, 1.5})
      for (const double albedo : {0.8, 0.95}) {
        const HalfSpaceLight light = half_space_light(albedo, eta, g);
        const double diffuse = light.reflectance * (1 - fresnel_diffuse(eta));
        for (const double degrees : {0.0, 45.0, 75.0}) {
          const double outside = std::cos(degrees * std::numbers::pi / 180),
                       inside = std::sqrt(1 - (1 - outside * outside) / (eta * eta));
          const double through = 1 - fresnel_dielectric(outside, eta),
                       expected = diffuse * through * escape_shape(light.escape, inside);
          KeyedRng rng(hash(uint64_t(albedo * 100), uint64_t(eta * 100), uint64_t(degrees), uint64_t(g * 10)));
          double sum = 0, squares = 0;
          for (int i = 0; i < photons; ++i) {
            const double w = through * walk_from(outside, albedo, eta, g, &rng);
            sum += w, squares += w * w;
          }
          const double mean = sum / photons, error = std::sqrt((squares / photons - mean * mean) / photons);
          EXPECT_NEAR(expected, mean, 4 * error + 0.01 * mean)
              << albedo << ", index " << eta << ", g " << g << ", " << degrees << " degrees";
        }
      }
}

TEST(HalfSpace, LosesNothingWithoutAbsorptionAndReturnsNothingWithoutScattering) {
  for (const double eta : {0.7, 1.0, 1.33, 2.0}) {
    EXPECT_EQ(half_space_reflectance(1, eta), 1);
    EXPECT_EQ(half_space_reflectance(0, eta), 0);
    EXPECT_GT(half_space_reflectance(0.9999999, eta), 0.995);
  }
}

TEST(HalfSpace, TableAndItsInverseGoRoundTrip) {
  const HalfSpaceTable table(1.4);
  for (const float albedo : {0.2f, 0.5f, 0.9f, 0.99f, 0.9995f}) {
    EXPECT_NEAR(table.reflectance(albedo), half_space_reflectance(albedo, 1.4), 1e-3);
    EXPECT_NEAR(table.albedo(table.reflectance(albedo)), albedo, 1e-4);
  }
  for (const float r : {0.0f, 0.01f, 0.3f, 0.9f, 1.0f}) EXPECT_NEAR(table.reflectance(table.albedo(r)), r, 1e-4);
  EXPECT_EQ(table.albedo(1), 1);
  const HalfSpaceTable forward(1.33, 0.8);
  for (const float albedo : {0.2f, 0.9f, 0.9995f}) {
    EXPECT_NEAR(forward.reflectance(albedo), half_space_reflectance(double(albedo), 1.33, 0.8), 1e-3);
    EXPECT_NEAR(forward.albedo(forward.reflectance(albedo)), albedo, 1e-3);
  }
}

}  // namespace
}  // namespace dapple
