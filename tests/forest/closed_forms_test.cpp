// SPDX-License-Identifier: Apache-2.0
// Illumination under trees, 5.9: limits with known answers. Numbers in names are those of its table.
#include <gtest/gtest.h>

#include "tests/forest/support.h"

namespace dapple::forest::test {
namespace {

// Rationale: black leaves only absorb. Expectation: uniform skylight is transmitted by 2 E3(tau), to 1e-6 with 32
// nodes.
TEST(ClosedForms, T01_AbsorptionOnly) {
  const double tau[] = {0.5, 1, 1.5, 3}, expected[] = {0.443209, 0.219384, 0.113479, 0.0178613};
  for (int i = 0; i < 4; ++i) {
    const CanopySolver s(canopy({isotropic(0), tau[i], 0.3, 2}), options(32));
    EXPECT_NEAR(budget(s, s.sky(Sky::uniform())).transmittance, expected[i], 1e-6);
    const Field beam = s.beam(0.4);
    EXPECT_NEAR(s.fluxes(beam).down_direct[0], 0.4 * std::exp(-tau[i] / 0.4), 1e-12);
    const double up = 0.3 / pi_d * 0.4 * std::exp(-tau[i] / 0.4);  // ground radiance, seen through the slab
    for (int n : {0, 13, 31}) EXPECT_NEAR(beam.up(2, 0, 0, n), up * std::exp(-tau[i] / s.options().nodes.mu[n]), 1e-12);
  }
}

// Rationale: for little scattering the second order is negligible. Expectation: the single-scattering formula to
// O(a^2).
TEST(ClosedForms, T02_SingleScattering) {
  const double a = 1e-6, depth = 0.7, mu0 = 0.35;
  const CanopySolver s(canopy({isotropic(a), depth, 0, 3}), options(8));
  const Field f = s.beam(mu0);
  for (int i = 0; i < 8; ++i) {
    const double mu = s.options().nodes.mu[i], path = 1 / mu + 1 / mu0;
    const double expected = a / (4 * pi_d) / mu * (1 - std::exp(-path * depth)) / path;
    EXPECT_NEAR(f.up(3, 0, 0, i) / expected, 1, 3e-6);
  }
}

// Rationale: where nothing absorbs, uniform light stays uniform. Expectation: radiance 1 / pi at every level and
// direction and in every view, 1e-10.
TEST(ClosedForms, T03_WhiteFurnace) {
  for (const char* name : {"sph", "pla", "ere", "plg", "ext", "uni", "hor"})
    for (double lai : {0.1, 3.0, 50.0}) {
      const CanopySolver s(canopy({leaves(angles(name), 0.5, 0.5), lai, 1, 4}), options(8, 2));
      const Field f = s.sky(Sky::uniform());
      for (int l = 0; l < s.levels(); ++l)
        for (int i = 0; i < 8; ++i) {
          EXPECT_NEAR(f.up(l, 0, 0, i) * pi_d, 1, 1e-10) << name << lai;
          EXPECT_NEAR(f.down(l, 0, 0, i) * pi_d, 1, 1e-10) << name << lai;
        }
      const double azimuth[] = {0.3};
      for (double mu : {0.9, 0.5, 0.13, -0.4})
        for (double v : s.radiance(f, mu, azimuth)) EXPECT_NEAR(v * pi_d, 1, 1e-10) << name << lai << " view " << mu;
      EXPECT_NEAR(budget(s, s.beam(0.42)).reflectance, 1, 1e-10) << name << lai;
    }
}

// Rationale: leaves that absorb nothing over a black ground. Expectation: the net flux is the same at all heights, and
// the two values of the table.
TEST(ClosedForms, T04_Conservation) {
  for (const char* name : {"sph", "pla", "ere", "hor"})
    for (double mu0 : {0.0, 0.2, 0.9}) {
      const CanopySolver s(canopy({leaves(angles(name), 0.7, 0.3), 3, 0, 5}), options(8));
      const Field f = mu0 > 0 ? s.beam(mu0) : s.sky(Sky::uniform());
      const Fluxes x = s.fluxes(f);
      for (int l = 0; l < s.levels(); ++l)
        EXPECT_NEAR(x.down_direct[l] + x.down_diffuse[l] - x.up[l], x.down_direct[0] + x.down_diffuse[0], 1e-12)
            << name << mu0;
    }
  const CanopySolver s(canopy({leaves(LeafAngles::spherical(), 0.5, 0.5), 3, 0, 1}), options(16));
  const Budget b = budget(s, s.sky(Sky::uniform()));
  EXPECT_NEAR(b.reflectance, 0.542812, 1e-6);
  EXPECT_NEAR(b.transmittance, 0.457188, 1e-6);
}

// Rationale: reciprocity. Expectation: radiance at direction b for a beam from a, over mu_a, equals the exchange, 1e-10
// for directions that are no nodes (nodes: symmetric matrices), with a ground that is no Lambertian.
TEST(ClosedForms, T05_Reciprocity) {
  Canopy c = canopy({leaves(LeafAngles::planophile(), 0.4, 0.35), 2.5, 0.2, 3});
  c.ground = rpv_ground({0.15}, 0.8, -0.2);
  const CanopySolver s(std::move(c), options(8, 6));
  for (double azimuth : {0.0, 1.1, pi_d}) {
    const double a[] = {azimuth};
    const size_t top = s.levels() - 1;
    const double forward = s.radiance(s.beam(0.8), 0.31, a)[top] / 0.8,
                 back = s.radiance(s.beam(0.31), 0.8, a)[top] / 0.31;
    EXPECT_NEAR(forward / back, 1, 1e-10);
  }
}

// Rationale: horizontal leaves make an exact two-stream problem for any nodes. Expectation: the closed form, 1e-10.
TEST(ClosedForms, T06_HorizontalLeaves) {
  const auto exact = [](double rho, double tau, double ground, double lai) {
    const double p = -(1 - tau), q = rho, k = std::sqrt(p * p - q * q), f1 = (-p - k) / q, f2 = 1 / f1;
    const double c = (ground - f1) / (ground - f2) * std::exp(-2 * k * lai);
    return (f1 - f2 * c) / (1 - c);
  };
  EXPECT_NEAR(exact(0.4, 0.3, 0.2, 2.5), 0.3076505449759777, 1e-15);
  for (int n : {1, 4, 9}) {
    const CanopySolver s(canopy({leaves(LeafAngles::horizontal(), 0.4, 0.3), 2.5, 0.2, 4}), options(n));
    EXPECT_NEAR(budget(s, s.beam(0.7)).reflectance, 0.3076505449759777, 1e-10);
    EXPECT_NEAR(budget(s, s.sky(Sky::uniform())).reflectance, 0.3076505449759777, 1e-10);
  }
  const CanopySolver s(canopy({leaves(LeafAngles::horizontal(), 0.45, 0.45), 2, 0.15, 1}), options(8, 4));
  const Field f = s.beam(std::cos(rad(30)));
  const Budget b = budget(s, f);
  EXPECT_NEAR(b.reflectance, 0.4317546137538, 1e-10);
  EXPECT_NEAR(b.transmittance, 0.4469496437598, 1e-10);
  const double azimuth[] = {0.0, 2.0};
  for (double mu : {0.95, 0.5, 0.1})
    for (int a : {0, 1})
      EXPECT_NEAR(s.radiance(f, mu, azimuth)[a * 2 + 1] * pi_d / std::cos(rad(30)), 0.4317546137538, 1e-10)
          << "same at every angle";
  const CanopySolver white(canopy({leaves(LeafAngles::horizontal(), 0.6, 0.4), 2.5, 0.2, 2}), options(5));
  EXPECT_NEAR(budget(white, white.beam(0.3)).reflectance, 1 - 1 / (0.6 * 2.5 + 1 / 0.8), 1e-10);
}

// Rationale: a deep isotropic medium obeys a nonlinear identity for the same nodes. Expectation: 1e-10 at a = .8, .99.
TEST(ClosedForms, T08_DiscreteHFunction) {
  for (double a : {0.8, 0.99}) {
    const int n = 8;
    const SolverOptions o = options(n);
    std::vector<double> h(n, 1.0);
    for (int pass = 0; pass < 3000; ++pass)
      for (int i = 0; i < n; ++i) {
        double sum = std::sqrt(1 - a);
        for (int j = 0; j < n; ++j)
          sum += a / 2 * o.nodes.w[j] * o.nodes.mu[j] * h[j] / (o.nodes.mu[i] + o.nodes.mu[j]);
        h[i] = 1 / sum;
      }
    const CanopySolver s(canopy({isotropic(a), 3000, 0, 1}), o);
    const Field f = s.sky(Sky::uniform());
    for (int i = 0; i < n; ++i) {
      double expected = 0;
      for (int j = 0; j < n; ++j)
        expected += a / 2 * o.nodes.w[j] * o.nodes.mu[j] / (o.nodes.mu[i] + o.nodes.mu[j]) * h[i] * h[j] / pi_d;
      EXPECT_NEAR(f.up(1, 0, 0, i), expected, 1e-10);
    }
  }
}

// Rationale: Chandrasekhar's H function gives the plane albedo of a half-space. Expectation: table values to 1e-5 with
// 24 nodes, directions that are no nodes included.
TEST(ClosedForms, T09_HalfSpaceAlbedo) {
  const auto rows = read_csv("H_function_isotropic.csv");
  int checked = 0;
  for (size_t r = 1; r < rows.size(); ++r) {
    const double a = std::stod(rows[r][0]);
    if (rows[r][1] == "H" || a >= 1) continue;
    const CanopySolver s(canopy({isotropic(a), 2000, 0, 1}), options(24));
    const double got = rows[r][1] == "plane_albedo" ? budget(s, s.beam(std::stod(rows[r][2]))).reflectance
                                                    : budget(s, s.sky(Sky::uniform())).reflectance;
    EXPECT_NEAR(got, std::stod(rows[r][3]), 1e-5) << a << rows[r][1] << rows[r][2];
    ++checked;
  }
  EXPECT_GT(checked, 10);
}

// Rationale: cutting a homogeneous canopy, and stretching it, changes nothing; more nodes change little.
TEST(ClosedForms, T13_Refinement) {
  const auto what = leaves(LeafAngles::erectophile(), 0.45, 0.4);
  const CanopySolver one(canopy({what, 4, 0.2, 1}), options(8, 4)), many(canopy({what, 4, 0.2, 37}), options(8, 4));
  Canopy uneven = canopy({what, 4, 0.2, 3});
  uneven.slabs = {{0, 7, {0.5}}, {7, 7.5, {3.25}}, {7.5, 9, {0.25}}};
  const CanopySolver stretched(uneven, options(8, 4)), fine(canopy({what, 4, 0.2, 1}), options(16, 4));
  const double azimuth[] = {0.4};
  for (double mu0 : {0.3, 0.5, 0.95}) {
    const Field f1 = one.beam(mu0), f2 = many.beam(mu0), f3 = stretched.beam(mu0);
    for (int i = 0; i < 8; ++i)
      for (int m = 0; m < 4; ++m) {
        EXPECT_NEAR(f1.up(1, 0, m, i), f2.up(37, 0, m, i), 1e-12);
        EXPECT_NEAR(f1.up(1, 0, m, i), f3.up(3, 0, m, i), 1e-12);
        EXPECT_NEAR(f1.down(0, 0, m, i), f2.down(0, 0, m, i), 1e-12);
      }
    for (double mu : {0.2, 0.5, 1.0}) {
      EXPECT_NEAR(one.radiance(f1, mu, azimuth)[1], many.radiance(f2, mu, azimuth)[37], 1e-11);
      EXPECT_NEAR(one.radiance(f1, -mu, azimuth)[0], many.radiance(f2, -mu, azimuth)[0], 1e-11);
      EXPECT_NEAR(one.radiance(f1, mu, azimuth)[1], stretched.radiance(f3, mu, azimuth)[3], 1e-11);
    }
    EXPECT_NEAR(budget(one, f1).reflectance, budget(fine, fine.beam(mu0)).reflectance, 2e-5);
  }
}

// Rationale: where a beam's path equals one of the slab's own decay rates the source equations are singular, the light
// is not. Black leaves make every node such a direction. Expectation: radiances vary smoothly through it, 1e-9.
TEST(ClosedForms, ResonantDirections) {
  const SolverOptions o = options(7);
  for (double albedo : {0.0, 1e-9, 0.3}) {
    const CanopySolver s(canopy({isotropic(albedo), 2, 0.3, 2}), o);
    for (int node : {1, 3, 5}) {
      const double mu = o.nodes.mu[node];
      const auto at = [&](double x) { return s.fluxes(s.beam(x)).up[2]; };
      const double middle = at(mu), around = (at(mu * (1 + 1e-4)) + at(mu * (1 - 1e-4))) / 2;
      EXPECT_NEAR(middle, around, 2e-8 * (1 + std::abs(middle))) << albedo;
      const double azimuth[] = {0.0};
      const Field sky = s.sky(Sky::uniform());
      EXPECT_NEAR(s.radiance(sky, mu, azimuth)[2], sky.up(2, 0, 0, node), 1e-10) << "a view along a node is the node";
      EXPECT_NEAR(s.radiance(sky, -mu, azimuth)[0], sky.down(0, 0, 0, node), 1e-10);
    }
  }
}

}  // namespace
}  // namespace dapple::forest::test
