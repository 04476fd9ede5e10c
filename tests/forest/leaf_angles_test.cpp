// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "dapple/forest/half_range.h"
#include "tests/forest/support.h"

namespace dapple::forest::test {
namespace {

// Rationale: every density counts the same leaf area. Expectation: integral one, mean inclinations of the closed forms.
TEST(LeafAngles, DensitiesAreNormalised) {
  const std::vector<LeafAngles> all{LeafAngles::spherical(),
                                    LeafAngles::planophile(),
                                    LeafAngles::erectophile(),
                                    LeafAngles::plagiophile(),
                                    LeafAngles::extremophile(),
                                    LeafAngles::uniform(),
                                    LeafAngles::beta(1, 0.3),
                                    LeafAngles::beta(0.4, 0.35),
                                    LeafAngles::ellipsoidal(0.2),
                                    LeafAngles::ellipsoidal(8),
                                    LeafAngles::table({0, 0.4, 1, pi_d / 2}, {1, 0, 3})};
  for (const LeafAngles& a : all) {
    const QuadratureRule fine = graded_rule(a.breaks(), 40);
    EXPECT_NEAR(fine.integrate([&](double t) { return a.density(t); }), 1, 2e-6) << &a - all.data();
    for (double t = 0; t < pi_d / 2; t += 0.01) EXPECT_GE(a.density(t), 0);
  }
  EXPECT_NEAR(LeafAngles::spherical().mean_inclination(), 1, 1e-12);  // radians
  EXPECT_NEAR(LeafAngles::planophile().mean_inclination(), pi_d / 4 - 1 / pi_d, 1e-12);
  EXPECT_NEAR(LeafAngles::beta(0.9, 0.3).mean_inclination(), 0.9, 1e-9);
  EXPECT_NEAR(LeafAngles::ellipsoidal(1).mean_inclination(), 1, 1e-9);
}

// Rationale: Goel and Strebel's variance of beta. Expectation: the standard deviation asked for.
TEST(LeafAngles, BetaHasItsVariance) {
  const LeafAngles b = LeafAngles::beta(0.8, 0.25);
  const double square = b.quadrature({}).integrate([](double t) { return t * t; });
  EXPECT_NEAR(std::sqrt(square - 0.64), 0.25, 1e-8);
}

// Rationale: the projection G is extinction. Expectation: reference values to their 8 digits.
TEST(LeafAngles, ProjectionMatchesReference) {
  const auto rows = read_csv("G_function.csv");
  for (size_t r = 1; r < rows.size(); ++r)
    for (size_t c = 1; c < rows[r].size(); ++c)
      EXPECT_NEAR(angles(rows[0][c]).projection(std::cos(rad(std::stod(rows[r][0])))), std::stod(rows[r][c]), 1.1e-8)
          << rows[0][c] << " " << rows[r][0];
  EXPECT_DOUBLE_EQ(LeafAngles::horizontal().projection(0.3), 0.3);
  EXPECT_NEAR(LeafAngles::vertical().projection(0.6), 2 / pi_d * 0.8, 1e-15);
}

TEST(LeafAngles, RefusesBadParameters) {
  EXPECT_THROW(LeafAngles::by_name("spheric"), std::invalid_argument);
  EXPECT_THROW(LeafAngles::beta(0.8, 0.9), std::invalid_argument);
  EXPECT_THROW(LeafAngles::beta(NAN, 0.1), std::invalid_argument);
  EXPECT_THROW(LeafAngles::ellipsoidal(-1), std::invalid_argument);
  EXPECT_THROW(LeafAngles::table({0, 1}, {0}), std::invalid_argument);
  EXPECT_THROW(LeafAngles::table({0, 1, 0.5}, {1, 1}), std::invalid_argument);
  EXPECT_THROW(LeafAngles::fixed(2), std::invalid_argument);
}

// Rationale: the area scattering function, three directions a row. Expectation: 1e-6, the references' trust.
TEST(AreaScattering, MatchesReferencePairs) {
  const auto rows = read_csv("gamma_pairs.csv");
  for (size_t r = 1; r < rows.size(); ++r) {
    const auto& c = rows[r];
    const auto mu = [&](int k) { return std::cos(rad(std::stod(c[k]))); };
    const double dphi = rad(std::stod(c[4]) - std::stod(c[2]));
    const Leaves l(angles(c[0]), {0.5}, {0.5});
    EXPECT_NEAR(pi_d * l.phase(0, mu(1), mu(3), dphi), std::stod(c[5]), 1e-6) << c[0] << " row " << r;
    EXPECT_NEAR(pi_d * l.phase(1, mu(1), mu(3), dphi), std::stod(c[6]), 1e-6) << c[0] << " row " << r;
  }
}

// Rationale: spherical leaves have a closed form (Shultis and Myneni). Expectation: 1e-8 at any pair of directions.
TEST(AreaScattering, SphericalClosedForm) {
  const Leaves l(LeafAngles::spherical(), {0.5}, {0.5});
  for (double mu : {-0.9, -0.3, 0.2, 0.7})
    for (double mu1 : {-0.8, -0.05, 0.5, 1.0})
      for (double phi : {0.0, 0.7, 2.0, pi_d}) {
        const double x = mu * mu1 + std::sqrt((1 - mu * mu) * (1 - mu1 * mu1)) * std::cos(phi), b = std::acos(x);
        const double part = (std::sin(b) - b * std::cos(b)) / (3 * pi_d);
        EXPECT_NEAR(l.phase(0, mu1, mu, phi), part / pi_d, 1e-8);
        EXPECT_NEAR(l.phase(1, mu1, mu, phi), (part + x / 3) / pi_d, 1e-8);
      }
}

// Rationale: the modes in closed form (5.3) must be those of the function itself. Expectation: 1e-6 for m = 0..5, all
// distributions, against azimuthal quadrature of phase().
TEST(AreaScattering, ModesAreThoseOfTheFunction) {
  for (const char* name : {"sph", "pla", "ere", "plg", "ext", "uni"}) {
    const Leaves l(angles(name), {0.5}, {0.5});
    Directions d(PolarNodes::gauss(3), 6);
    const Kernel k = l.kernel(d);
    const auto& mu = d.nodes().mu;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < i; ++j)  // diagonals hold the energy fix
        for (int component = 0; component < 2; ++component)
          for (int m = 0; m < 6; ++m) {
            double same = 0, opposite = 0;
            const int count = 100;
            for (int s = 0; s < count; ++s) {
              const double phi = pi_d * (s + 0.5) / count, w = 2 * pi_d / count * std::cos(m * phi);
              same += w * l.phase(component, mu[j], mu[i], phi);
              opposite += w * l.phase(component, -mu[j], mu[i], phi);
            }
            EXPECT_NEAR(k.components[component].same[(m * 3 + i) * 3 + j], same, 1e-6) << name << m;
            EXPECT_NEAR(k.components[component].opposite[(m * 3 + i) * 3 + j], opposite, 1e-6) << name << m;
          }
  }
}

// Rationale: bi-Lambertian asymmetry is (4/9)(tau - rho)/(tau + rho) for spherical leaves; all light scattered is
// kappa.
TEST(AreaScattering, AsymmetryAndTotal) {
  const Leaves l(LeafAngles::spherical(), {0.3}, {0.6});
  const QuadratureRule mu = gauss_legendre(60, -1, 1);
  double total = 0, first = 0;
  for (size_t i = 0; i < mu.x.size(); ++i) {
    const double s = 2 * pi_d * mu.w[i] * (0.3 * l.phase(0, 1, mu.x[i], 0) + 0.6 * l.phase(1, 1, mu.x[i], 0));
    total += s;
    first += s * mu.x[i];
  }
  EXPECT_NEAR(total, 0.9 * 0.5, 1e-6);
  EXPECT_NEAR(first / total, 4.0 / 9 * 0.3 / 0.9, 1e-6);
}

// Rationale: mirror leaves return F of what they intercept. Expectation: the integral of the scattering function, by
// Gauss and midpoints, is the intercepted light times its mean Fresnel reflectance to 1e-4.
TEST(AreaScattering, MirrorKeepsEnergy) {
  const Leaves l(LeafAngles::spherical(), {0.05}, {0.05}, 1.5);
  const QuadratureRule mu = gauss_legendre(120, -1, 1);
  double total = 0;
  for (size_t i = 0; i < mu.x.size(); ++i)
    for (int s = 0; s < 400; ++s) total += mu.w[i] * 2 * pi_d / 400 * l.phase(2, -0.6, mu.x[i], pi_d * (s + 0.5) / 400);
  EXPECT_NEAR(total, 0.5 * l.specular_albedo(0.6), 1e-4);
  EXPECT_NEAR(l.specular_albedo(0.6), 0.0918, 1e-3);  // 2 times the integral of F(x) x for index 1.5
}

}  // namespace
}  // namespace dapple::forest::test
