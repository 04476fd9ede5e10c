// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/irradiance_table.h"

#include <gtest/gtest.h>

#include "tests/forest/support.h"

namespace dapple::forest {
namespace {

using From = CanopySolver::From;

CanopySolver solver_of(double rho, double tau, double ground, int slabs) {
  Canopy canopy;
  canopy.wavelengths = 3;
  canopy.constituents = {std::make_shared<Leaves>(LeafAngles::spherical(), std::vector<double>(3, rho),
                                                  std::vector<double>{tau, tau / 2, 0})};
  for (int s = 0; s < slabs; ++s) canopy.slabs.push_back({double(s), double(s + 1), {2.0 / slabs}});
  canopy.ground.reflectance.assign(3, ground);
  return CanopySolver(canopy, {});
}

std::vector<double> heights(const CanopySolver& solver) {
  std::vector<double> z;
  for (int l = 0; l < solver.levels(); ++l) z.push_back(solver.height(l));
  return z;
}

V3f normal(double mu, double phi) {
  const double s = std::sqrt(1 - mu * mu);
  return V3f(V3d(s * std::cos(phi), s * std::sin(phi), mu));
}

// Rationale: what is kept of irradiance by normal are harmonics up to degree 2, and those of degree 4 are all that it
// has beyond (degree 3 has no clamped cosine): 1/16 of the mean at most, and much less for light that comes from
// everywhere in a canopy. Expectation: the solver's own irradiance within 2.5 % of the larger side, at all levels,
// normals and channels; both sides of a surface are the same look-up from either; light from above and below add up.
TEST(IrradianceTable, IsTheSolversIrradiance) {
  const CanopySolver solver = solver_of(.45, .4, .2, 4);
  const double beam_azimuth = 0.7;
  const Field field = solver.beam(0.77);
  IrradianceTable all(heights(solver)), above(heights(solver)), below(heights(solver));
  all.add(solver, field, beam_azimuth, RGB(2), From::everywhere);
  above.add(solver, field, beam_azimuth, RGB(2), From::above);
  below.add(solver, field, beam_azimuth, RGB(2), From::below);
  for (const double mu : {-0.95, -0.4, 0.0, 0.3, 0.8, 1.0})
    for (const double phi : {0.0, 1.1, 3.0, 5.2}) {
      const auto front = solver.irradiance(field, mu, phi - beam_azimuth),
                 behind = solver.irradiance(field, -mu, phi + test::pi_d - beam_azimuth);
      for (int l = 0; l < solver.levels(); ++l) {
        const float z = float(solver.height(l));
        const auto E = all.at(z, normal(mu, phi)), other = all.at(z, -normal(mu, phi));
        const auto a = above.at(z, normal(mu, phi)), b = below.at(z, normal(mu, phi));
        for (int c = 0; c < 3; ++c) {
          const size_t i = size_t(l * 3 + c);
          const double tolerance = 2 * 0.025 * std::max(front[i], behind[i]);
          EXPECT_NEAR(E.front[c], 2 * front[i], tolerance) << mu << " " << phi << " level " << l;
          EXPECT_NEAR(E.behind[c], 2 * behind[i], tolerance) << mu << " " << phi << " level " << l;
          EXPECT_NEAR(E.front[c], other.behind[c], 1e-5f);
          EXPECT_NEAR(a.front[c] + b.front[c], E.front[c], 0.02 * E.front[c] + 0.02 * E.behind[c]);
        }
      }
    }
}

// Rationale: linear between levels, constant beyond. Expectation: so, to rounding.
TEST(IrradianceTable, ByHeight) {
  const CanopySolver solver = solver_of(.1, .1, .1, 3);
  IrradianceTable table(heights(solver));
  table.add(solver, solver.sky(Sky::uniform()), 0, RGB(1), From::everywhere);
  const V3f n = normal(0.5, 1);
  const RGB low = table.at(1, n).front, high = table.at(2, n).front, between = table.at(1.25f, n).front;
  for (int c = 0; c < 3; ++c) {
    EXPECT_LT(low[c], high[c]);
    EXPECT_NEAR(between[c], 0.75f * low[c] + 0.25f * high[c], 1e-5f);
    EXPECT_EQ(table.at(-5, n).front[c], table.at(0, n).front[c]);
    EXPECT_EQ(table.at(50, n).front[c], table.at(3, n).front[c]);
  }
  const IrradianceTable middles = table.middles();
  ASSERT_EQ(middles.heights().size(), 3u);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(middles.at(1.5f, n).front[c], 0.5f * (low[c] + high[c]), 1e-5f);
}

}  // namespace
}  // namespace dapple::forest
