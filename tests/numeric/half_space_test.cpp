// SPDX-License-Identifier: Apache-2.0
#include "dapple/numeric/half_space.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "dapple/base/hash.h"
#include "dapple/numeric/fresnel.h"

namespace dapple {
namespace {

// Share of photons that leave again, by a walk that knows nothing of H-functions.
double walk(double albedo, double eta, int photons, uint64_t key) {
  KeyedRng rng(key);
  double sum = 0;
  for (int i = 0; i < photons; ++i) {
    double outside;
    do outside = std::sqrt(double(rng.next()));
    while (rng.next() < fresnel_dielectric(outside, eta));
    double mu = std::sqrt(1 - (1 - outside * outside) / (eta * eta)), z = 0, weight = 1;
    while (weight > 1e-4) {
      const double t = -std::log1p(-double(rng.next()));
      if (mu < 0 && z + t * mu <= 0) {
        const double inside = fresnel_dielectric(-mu, 1 / eta);
        sum += weight * (1 - inside);
        weight *= inside;
        z = 0, mu = -mu;
        continue;
      }
      z += t * mu;
      weight *= albedo;
      mu = 1 - 2 * double(rng.next());
    }
  }
  return sum / photons;
}

// Rationale: two independent computations. Expected: equal within four standard errors (a photon's weight varies by
// less than .5).
TEST(HalfSpace, AgreesWithMonteCarlo) {
  constexpr int photons = 60000;
  for (const double eta : {1.0, 1.33, 1.5, 0.8})
    for (const double albedo : {0.3, 0.8, 0.95})
      EXPECT_NEAR(half_space_reflectance(albedo, eta), walk(albedo, eta, photons, uint64_t(albedo * 100)),
                  4 * 0.5 / std::sqrt(photons))
          << albedo << ", index " << eta;
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
}

}  // namespace
}  // namespace dapple
