// SPDX-License-Identifier: Apache-2.0
#include "dapple/numeric/branchless.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "dapple/base/hash.h"
#include "dapple/base/vec.h"

namespace dapple {
namespace {

TEST(Branchless, SineAndCosine) {
  const auto check = [](double angle, double error) {
    const auto [sine, cosine] = sine_cosine(angle);
    EXPECT_NEAR(sine, std::sin(angle), error) << angle;
    EXPECT_NEAR(cosine, std::cos(angle), error) << angle;
  };
  for (int i = -100000; i <= 100000; ++i) check(i * (13 / 1e5), 1e-15);
  for (int quarter = -8; quarter <= 8; ++quarter)
    for (const double beside : {-1e-9, -1e-16, 0.0, 1e-16, 1e-9}) check(quarter * std::numbers::pi / 2 + beside, 1e-15);
  for (const double angle : {-1000.0, 999.9}) check(angle, 1e-13);
}

TEST(Branchless, Argument) {
  const auto expected = [](double x, double y) {
    const double a = std::atan2(y, x);
    return a < 0 ? a + 2 * std::numbers::pi : a;
  };
  KeyedRng rng(1);
  for (int i = 0; i < 200000; ++i) {
    const double angle = 2 * std::numbers::pi * rng.next(), length = std::pow(10.0, 40 * rng.next() - 20);
    const double x = length * std::cos(angle), y = length * std::sin(angle);
    EXPECT_NEAR(argument(x, y), expected(x, y), 1e-15) << x << " " << y;
  }
  for (const double tiny : {1e-3, 1e-9, 1e-200}) {
    EXPECT_NEAR(argument(1, tiny) / tiny, std::atan(tiny) / tiny, 1e-15);
    EXPECT_NEAR(argument(tiny, 1), expected(tiny, 1), 1e-15);
  }
  for (const double x : {-1.0, 0.0, 1.0})
    for (const double y : {-1.0, 0.0, 1.0}) EXPECT_NEAR(argument(x, y), expected(x, y), 1e-15) << x << " " << y;
}

}  // namespace
}  // namespace dapple
