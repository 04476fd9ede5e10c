// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/sky_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace dapple::forest {
namespace {

constexpr double pi_d = std::numbers::pi;

// Cell (r, c) has the value 10 r + c, and 1000 more in each further channel.
SkyTable numbered(int channels) {
  SkyTable table{3, 4, channels, {}};
  for (int r = 0; r < table.rows; ++r)
    for (int c = 0; c < table.columns; ++c)
      for (int k = 0; k < channels; ++k) table.values.push_back(10 * r + c + 1000 * k);
  return table;
}

// A place in rows and columns.
double at(const SkyTable& table, double row, double column, int w = 0) {
  return table.at(std::cos(pi_d / 2 * row / table.rows), 2 * pi_d * column / table.columns, w);
}

// Expectation: the value of a cell in its middle, linear between middles, also across azimuth 0; for azimuths of any
// number of turns.
TEST(SkyTable, IsBilinearAndGoesRound) {
  const SkyTable table = numbered(3);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c)
      for (int w = 0; w < 3; ++w) EXPECT_NEAR(at(table, r + 0.5, c + 0.5, w), 10 * r + c + 1000 * w, 1e-9);
  EXPECT_NEAR(at(table, 1.25, 2.0), 7.5 + 1.5, 1e-9);
  EXPECT_NEAR(at(table, 0.5, 0), (3 + 0) / 2.0, 1e-9);
  EXPECT_NEAR(at(table, 0.5, 3.75), 0.75 * 3 + 0.25 * 0, 1e-9);
  for (const double turns : {-3.0, 1.0, 5.0}) EXPECT_NEAR(at(table, 1.3, 0.9 + 4 * turns), at(table, 1.3, 0.9), 1e-9);
}

// Expectation: the first row's value at the zenith, where a cosine may be above 1 by a rounding, and the last one's at
// the horizon.
TEST(SkyTable, IsConstantAtZenithAndHorizon) {
  const SkyTable table = numbered(1);
  for (const double mu : {1.0, std::nextafter(1.0, 2.0), 1 + 1e-9})
    EXPECT_NEAR(table.at(mu, pi_d / 4, 0), 0, 1e-9) << mu;
  for (const double mu : {1.0, std::nextafter(1.0, 2.0), 1 + 1e-9})
    EXPECT_NEAR(table.at(mu, 7 * pi_d / 4, 0), 3, 1e-9) << mu;
  EXPECT_NEAR(table.at(0, pi_d / 4, 0), 20, 1e-9);
}

TEST(SkyTable, OneChannelIsThatOfAllWavelengths) {
  const SkyTable table = numbered(1);
  EXPECT_EQ(table.at(0.4, 1, 41), table.at(0.4, 1, 0));
}

}  // namespace
}  // namespace dapple::forest
