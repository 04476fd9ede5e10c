// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "dapple/base/error.h"
#include "dapple/base/parallel.h"
#include "tests/forest/support.h"

namespace dapple::forest::test {
namespace {

// Three wavelengths, two kinds of leaves and wood in uneven layers, over a bidirectional ground.
Canopy mixed() {
  Canopy c;
  c.wavelengths = 3;
  c.constituents = {
      std::make_shared<Leaves>(LeafAngles::planophile(), std::vector{.05, .11, .45}, std::vector{.04, .1, .45}),
      std::make_shared<Leaves>(LeafAngles::beta(1, .3), std::vector{.04, .09, .5}, std::vector{.02, .08, .5}, 0),
      std::make_shared<Leaves>(LeafAngles::vertical(), std::vector{.15, .12, .09}, std::vector{0., 0., 0.})};
  c.slabs = {{0, 2, {0.1, 0, 0.3}}, {2, 5, {0, 0, 0.05}}, {5, 8, {1.2, 0.4, 0.2}}, {8, 9, {0, 1.5, 0}}};
  c.ground = rpv_ground({.1, .12, .2}, 0.8, -0.15);
  return c;
}

// Rationale: two methods that share nothing but the kernels. Expectation: radiances at all levels, modes and nodes
// agree to 1e-9 for sun and sky, in layered canopies of several wavelengths.
TEST(Solver, RiccatiAgreesWithAddingDoubling) {
  SolverOptions o = options(8, 4);
  const CanopySolver adding(mixed(), o);
  o.method = Method::riccati;
  const CanopySolver riccati(mixed(), o);
  double worst = 0;
  for (int source = 0; source < 3; ++source) {
    const auto field = [&](const CanopySolver& s) {
      return source == 0   ? s.beam(std::cos(rad(35)))
             : source == 1 ? s.beam(0.15)
                           : s.sky(Sky::cie_clear(0.6), {1, 2, 3});
    };
    const Field a = field(adding), b = field(riccati);
    for (int l = 0; l < adding.levels(); ++l)
      for (int w = 0; w < 3; ++w)
        for (int m = 0; m < 4; ++m)
          for (int i = 0; i < 8; ++i) {
            worst = std::max({worst, std::abs(a.up(l, w, m, i) - b.up(l, w, m, i)),
                              std::abs(a.down(l, w, m, i) - b.down(l, w, m, i))});
          }
  }
  EXPECT_LT(worst, 1e-9);
  EXPECT_GT(worst, 0) << "the two were the same method";
}

// Rationale: the sine part of a sky is solved by the same operators. Expectation: a sky turned by 90 degrees gives the
// turned irradiance, from its cosine and sine fields together, 1e-12.
TEST(Solver, SkiesOfAnyAzimuth) {
  const CanopySolver s(mixed(), options(8, 5));
  const auto sky = [](double turn) {
    Sky k;
    k.radiance = [turn](double mu, double phi, int) {
      return 1 + 0.5 * std::sqrt(1 - mu * mu) * std::cos(phi - turn) + 0.2 * mu;
    };
    return k;
  };
  const Field straight = s.sky(sky(0)), c = s.sky(sky(1.3)), odd = s.sky(sky(1.3), {}, true);
  for (double phi : {0.0, 0.8, 4.0}) {
    const auto a = s.irradiance(straight, 0.3, phi), b = s.irradiance(c, 0.3, phi + 1.3),
               d = s.irradiance(odd, 0.3, phi + 1.3);
    for (size_t k = 0; k < a.size(); ++k) EXPECT_NEAR(a[k], b[k] + d[k], 1e-12);
  }
}

// Rationale: modes beyond the solver's must not matter once there are enough, and a view along a node must be that
// node.
TEST(Solver, ViewsAlongNodes) {
  const CanopySolver s(mixed(), options(8, 12));
  const Field f = s.sky(Sky::cie_overcast());
  const double azimuth[] = {0.0};
  for (int i = 0; i < 8; ++i) {
    const auto up = s.radiance(f, s.options().nodes.mu[i], azimuth),
               down = s.radiance(f, -s.options().nodes.mu[i], azimuth);
    for (int l = 0; l < s.levels(); ++l)
      for (int w = 0; w < 3; ++w) {
        EXPECT_NEAR(up[l * 3 + w], f.up(l, w, 0, i), 2e-6) << "apart from the nodes' energy fix";
        EXPECT_NEAR(down[l * 3 + w], f.down(l, w, 0, i), 2e-6);
      }
  }
}

// Rationale: reflectance factors integrate to albedo. Expectation: 1e-5 by Gauss quadrature over view directions.
TEST(Solver, ReflectanceFactorsIntegrateToAlbedo) {
  const CanopySolver s(mixed(), options(16, 8));
  const Field f = s.beam(0.7);
  const QuadratureRule mu = gauss_legendre(12, 0, 1);
  std::vector<double> azimuths;
  for (int k = 0; k < 24; ++k) azimuths.push_back(pi_d * (k + 0.5) / 24);
  double flux[3] = {};
  for (size_t i = 0; i < mu.x.size(); ++i) {
    const auto v = s.radiance(f, mu.x[i], azimuths);
    for (size_t a = 0; a < azimuths.size(); ++a)
      for (int w = 0; w < 3; ++w)
        flux[w] += 2 * pi_d / 24 * mu.w[i] * mu.x[i] * v[(a * s.levels() + s.levels() - 1) * 3 + w];
  }
  const Fluxes x = s.fluxes(f);
  for (int w = 0; w < 3; ++w) EXPECT_NEAR(flux[w] / x.up[(s.levels() - 1) * 3 + w], 1, 2e-4);
}

// Rationale: E(z, n) of an upward normal is the downward diffuse flux, and leaves shaded by it scatter what the source
// function says (5.8). Expectation: 1e-12 for the flux; 1e-6 for the mean over spherical leaves.
TEST(Solver, ShadingTables) {
  const CanopySolver s(mixed(), options(16, 6));
  const Field f = s.beam(0.6);
  const Fluxes x = s.fluxes(f);
  const auto above = s.irradiance(f, 1, 0), below = s.irradiance(f, -1, 0);
  for (size_t k = 0; k < above.size(); ++k) {
    EXPECT_NEAR(above[k], x.down_diffuse[k], 1e-12);
    EXPECT_NEAR(below[k], x.up[k], 1e-12);
  }
  // The mean over all normals of E(n) + E(-n) is half the light that crosses a point (spherical leaves intercept half).
  const QuadratureRule mu = gauss_legendre(200, 0, 1);
  for (int l = 0; l < s.levels(); ++l) {
    double mean = 0, crossing = 0;
    for (size_t q = 0; q < mu.x.size(); ++q)  // azimuths average to the zeroth mode: two opposite ones keep even modes
      for (int a = 0; a < 16; ++a)
        mean += mu.w[q] / 16 *
                (s.irradiance(f, mu.x[q], pi_d * a / 8)[l * 3] + s.irradiance(f, -mu.x[q], pi_d * a / 8 + pi_d)[l * 3]);
    for (int i = 0; i < 16; ++i)
      crossing += 2 * pi_d * s.options().nodes.w[i] * (f.up(l, 0, 0, i) + f.down(l, 0, 0, i));
    EXPECT_NEAR(mean, crossing / 2, 1e-5 * crossing);
  }
  // A lobe of exponent one about the downward direction is the flux through a horizontal plane over pi.
  const auto lobe = s.lobe(f, -1, 0, 1);
  for (size_t k = 0; k < lobe.size(); ++k) EXPECT_NEAR(lobe[k] * pi_d, x.down_diffuse[k], 1e-10);
}

// Rationale: the hot spot adds light, most of it exactly opposite the beam, none without leaves' size; there the joint
// gap probability of a homogeneous canopy is that of one path. Expectation: the closed form at the hot spot, 1e-6.
TEST(Solver, HotSpot) {
  const double lai = 3, rho = 0.05, tau = 0.04, ground = 0.1, mu = std::cos(rad(40));
  const CanopySolver s(canopy({leaves(LeafAngles::spherical(), rho, tau), lai, ground, 4}), options(8));
  const auto sun = s.direction(mu), other = s.direction(std::cos(rad(20)));
  const double k = 0.5 / mu, sigma = rho / (3 * pi_d);
  const double with = sigma / mu * lai * (1 - std::exp(-k * lai)) / (k * lai) + ground / pi_d * mu * std::exp(-k * lai);
  const double without =
      sigma / mu * lai * (1 - std::exp(-2 * k * lai)) / (2 * k * lai) + ground / pi_d * mu * std::exp(-2 * k * lai);
  EXPECT_NEAR(s.hot_spot(*sun, *sun, pi_d, 0.1)[0], with - without, 1e-6);
  const double near = s.hot_spot(*sun, *other, pi_d, 0.1)[0], far = s.hot_spot(*sun, *other, 0, 0.1)[0];
  EXPECT_GT(with - without, near);
  EXPECT_GT(near, far);
  EXPECT_GT(far, 0);
  EXPECT_EQ(s.hot_spot(*sun, *sun, pi_d, 0)[0], 0);
}

// Rationale: promise 3. Expectation: the same bits for any number of threads.
TEST(Solver, SameBitsForAnyThreads) {
  const auto result = [] {
    Canopy c = canopy(
        {std::make_shared<Leaves>(LeafAngles::spherical(), std::vector(300, .4), std::vector(300, .3)), 3, 0, 3});
    c.wavelengths = 300;
    c.ground.reflectance.assign(300, 0.2);
    const CanopySolver s(c, options(4, 2));
    return s.fluxes(s.beam(0.5)).up;
  };
  const int before = thread_count();
  set_thread_count(1);
  const auto one = result();
  set_thread_count(4);
  const auto four = result();
  set_thread_count(before);
  EXPECT_EQ(one, four);
}

// Rationale: slabs without leaves, deep canopies and grazing suns stay finite and within bounds.
TEST(Solver, Extremes) {
  for (double lai : {0.0, 1e-9, 200.0})
    for (double mu0 : {1e-4, 0.5, 1.0}) {
      const CanopySolver s(canopy({leaves(LeafAngles::vertical(), 0.5, 0.45), lai, 0.3, 3}), options(8, 3));
      const Field f = s.beam(mu0);
      const Budget b = budget(s, f);
      EXPECT_GE(b.reflectance, 0) << lai << mu0;
      EXPECT_LE(b.reflectance, 1 + 1e-12) << lai << mu0;
      if (lai == 0) {
        EXPECT_NEAR(b.reflectance, 0.3, 1e-12);
      }
      const double azimuth[] = {1.0};
      for (double mu : {1.0, 0.3, -0.3, -1.0})
        for (double v : s.radiance(f, mu, azimuth))
          EXPECT_TRUE(std::isfinite(v) && v >= 0) << lai << " " << mu0 << " " << mu;
    }
}

TEST(Solver, RefusesBadInput) {
  const auto what = leaves(LeafAngles::spherical(), 0.4, 0.4);
  EXPECT_THROW(leaves(LeafAngles::spherical(), 0.6, 0.5), std::invalid_argument);
  EXPECT_THROW(leaves(LeafAngles::spherical(), NAN, 0.5), std::invalid_argument);
  EXPECT_THROW(leaves(LeafAngles::horizontal(), 0.1, 0.5, 1.5), std::invalid_argument);
  EXPECT_THROW(CanopySolver(canopy({what, -1, 0, 1}), options(4)), std::invalid_argument);
  EXPECT_THROW(CanopySolver(canopy({what, 1, 1.5, 1}), options(4)), std::invalid_argument);
  EXPECT_THROW(CanopySolver(canopy({what, 1, 0, 0}), options(4)), std::invalid_argument);
  EXPECT_THROW(CanopySolver(canopy({leaves(LeafAngles::spherical(), 0.5, 0.5, 1.5), 1, 0, 1}), options(4)),
               std::invalid_argument);
  EXPECT_THROW(PolarNodes::gauss(0), std::invalid_argument);
  SolverOptions small = options(8, 4);
  small.max_bytes = 1000;
  EXPECT_THROW(CanopySolver(canopy({what, 1, 0, 1}), small), MemoryError);
  const CanopySolver s(canopy({what, 1, 0, 1}), options(4));
  EXPECT_THROW(s.direction(0), std::invalid_argument);
  EXPECT_THROW(s.direction(NAN), std::invalid_argument);
}

}  // namespace
}  // namespace dapple::forest::test
