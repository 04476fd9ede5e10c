// SPDX-License-Identifier: Apache-2.0
#include "dapple/numeric/fresnel.h"

#include <gtest/gtest.h>

#include <complex>

#include "dapple/base/vec.h"
#include "dapple/numeric/quadrature.h"

namespace dapple {
namespace {

TEST(GaussLegendre, ExactForPolynomialsOfTwiceItsDegree) {
  for (const int n : {1, 2, 3, 5, 16, 33}) {
    const QuadratureRule rule = gauss_legendre(n, 0, 1);
    for (int degree = 0; degree < 2 * n; ++degree)
      EXPECT_NEAR(rule.integrate([&](double x) { return std::pow(x, degree); }), 1.0 / (degree + 1), 1e-14)
          << n << " " << degree;
    // One degree more is not exact; its error, (n!)^4 / ((2n + 1) ((2n)!)^2), is far above round-off for small n.
    if (n <= 5) {
      EXPECT_GT(std::abs(rule.integrate([&](double x) { return std::pow(x, 2 * n); }) - 1.0 / (2 * n + 1)), 1e-7);
    }
  }
}

TEST(GaussLegendre, KnownNodesAndLargeRules) {
  const QuadratureRule three = gauss_legendre(3);
  EXPECT_NEAR(three.x[0], -std::sqrt(0.6), 1e-15);
  EXPECT_EQ(three.x[1], 0);
  EXPECT_NEAR(three.w[1], 8.0 / 9, 1e-15);
  for (const int n : {100, 1001}) {
    const QuadratureRule rule = gauss_legendre(n, -2, 3);
    EXPECT_NEAR(rule.integrate([](double) { return 1; }), 5, 1e-12);
    EXPECT_NEAR(rule.integrate([](double x) { return std::exp(x); }), std::exp(3) - std::exp(-2), 1e-11);
    EXPECT_TRUE(std::is_sorted(rule.x.begin(), rule.x.end()));
  }
  EXPECT_THROW(gauss_legendre(0), std::invalid_argument);
}

/// Fresnel's equations as they stand in textbooks, in complex arithmetic.
double reference(double cos_i, std::complex<double> n) {
  const std::complex<double> ct = std::sqrt(1.0 - (1 - cos_i * cos_i) / (n * n));
  const double s = std::norm((cos_i - n * ct) / (cos_i + n * ct)), p = std::norm((n * cos_i - ct) / (n * cos_i + ct));
  return (s + p) / 2;
}

TEST(Fresnel, MatchesComplexArithmetic) {
  for (const double n : {0.04, 0.5, 1.0, 1.5, 2.4, 10.0}) {
    for (const double k : {0.0, 0.01, 1.0, 3.0, 20.0}) {
      for (double c = 0.01; c <= 1; c += 0.01) {
        if (k == 0 && n < 1 && 1 - c * c >= n * n) continue;  // total reflection: below
        const double want = reference(c, {n, k});
        EXPECT_NEAR(fresnel_conductor(c, n, k), want, 1e-12) << n << " " << k << " " << c;
        EXPECT_NEAR(fresnel_conductor<float>(float(c), float(n), float(k)), want, 2e-5) << n << " " << k << " " << c;
        if (k == 0) {
          EXPECT_NEAR(fresnel_dielectric(c, n), want, 1e-12);
        }
      }
    }
  }
}

TEST(Fresnel, KnownPoints) {
  EXPECT_NEAR(fresnel_dielectric(1.0f, 1.5f), 0.04f, 1e-7f);
  EXPECT_NEAR(fresnel_dielectric(-1.0f, 1.5f), 0.04f, 1e-7f);
  EXPECT_EQ(fresnel_dielectric(0.0f, 1.5f), 1);
  EXPECT_EQ(fresnel_conductor(0.0f, 0.2f, 3.0f), 1);
  const double brewster =
      std::cos(std::atan(1.5));  // parallel part vanishes: half of the other, ((n^2 - 1) / (n^2 + 1))^2
  EXPECT_NEAR(fresnel_dielectric(brewster, 1.5), sqr(1.25f / 3.25f) / 2, 1e-7);
}

TEST(Fresnel, RefractionObeysSnellAndReciprocity) {
  for (const double eta : {1.1, 1.5, 2.4}) {
    for (double c = 0.02; c <= 1; c += 0.02) {
      double ct, back;
      const double f = fresnel_dielectric(c, eta, &ct);
      EXPECT_LT(ct, 0);
      EXPECT_NEAR(std::sqrt(1 - c * c), eta * std::sqrt(1 - ct * ct), 1e-12);
      EXPECT_NEAR(fresnel_dielectric(ct, eta, &back), f, 1e-10);
      EXPECT_NEAR(back, c, 1e-9);
    }
    double ct = 5;
    EXPECT_EQ(fresnel_dielectric(-0.9 * std::sqrt(1 - 1 / (eta * eta)), eta, &ct), 1);  // beyond the critical angle
    EXPECT_EQ(ct, 0);
  }
}

TEST(Fresnel, FiniteForExtremes) {
  for (const float c : {0.0f, 1e-20f, 1e-4f, 1.0f, 2.0f})
    for (const float n : {0.0f, 1e-45f, 1e-6f, 1.0f, 1e6f, 1e10f, 3e38f, infinity})
      for (const float k : {0.0f, 1e-45f, 1e-6f, 1e6f, 1e10f, 3e38f, infinity}) {
        const float f = fresnel_conductor(c, n, k);
        EXPECT_TRUE(f >= 0 && f <= 1) << c << " " << n << " " << k << ": " << f;
        // 1 - R is below 4 n / (n^2 + k^2) / c (Born & Wolf 14.2).
        if (c == 1 && std::max(n, k) >= 1e10f) {
          EXPECT_NEAR(f, 1, 1e-6f) << n << " " << k;
        }
      }
}

TEST(Fresnel, DiffuseClosedFormIsTheIntegral) {
  const QuadratureRule rule = gauss_legendre(2000, 0, 1);
  for (const double eta : {1.00005, 1.001, 1.1, 1.33, 1.5, 2.5, 10.0}) {
    // mu = 1 - t^2 and, inside, mu^2 from the critical angle smooth the square roots away.
    const double external = rule.integrate([&](double t) {
      const double mu = t * t;
      return 2 * fresnel_dielectric(mu, eta) * mu * 2 * t;
    });
    const double critical = std::sqrt(1 - 1 / (eta * eta));
    const double internal = critical * critical + rule.integrate([&](double t) {
      const double mu = critical + (1 - critical) * t * t;
      return 2 * fresnel_dielectric(mu, 1 / eta) * mu * (1 - critical) * 2 * t;
    });
    EXPECT_NEAR(fresnel_diffuse(eta), external, 1e-5) << eta;
    EXPECT_NEAR(fresnel_diffuse(1 / eta), internal, 1e-5) << eta;
  }
  EXPECT_EQ(fresnel_diffuse(1), 0);
  EXPECT_NEAR(fresnel_diffuse(1.5), 0.0918, 5e-5);  // 9.2 % of Duntley's paper
}

TEST(Fresnel, ConductorOfAReflectance) {
  for (float r = 0; r <= 0.999f; r += 0.01f)
    EXPECT_NEAR(fresnel_conductor(1.0f, 1.0f, conductor_k_from_reflectance(r)), r, 2e-6f);
  EXPECT_TRUE(std::isfinite(conductor_k_from_reflectance(1)));
}

}  // namespace
}  // namespace dapple
