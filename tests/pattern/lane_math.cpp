// SPDX-License-Identifier: Apache-2.0
#include "dapple/pattern/lane_math.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "dapple/base/hash.h"

namespace dapple::pattern {
namespace {

constexpr float infinite = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();

/// Distance of v from the exact value, in units of the exact value's last place.
double ulps(float v, double exact) {
  int exponent;
  std::frexp(exact, &exponent);
  return std::abs(v - exact) / std::ldexp(1.0, std::max(exponent - 24, -149));
}

/// A float of either sign, its magnitude spread evenly over exponents of 2 in [low, high].
float spread(KeyedRng& rng, float low, float high, bool both_signs = true) {
  const float v = std::exp2(low + (high - low) * rng.next());
  return both_signs && rng.next() < 0.5f ? -v : v;
}

TEST(LaneMath, StatedAccuracy) {
  KeyedRng rng(1);
  double exp = 0, log = 0, pow = 0, atan2 = 0, sin = 0, cos = 0;
  for (int i = 0; i < 300000; ++i) {
    const float x = 174 * rng.next() - 87;
    exp = std::max(exp, ulps(lane::exp(x), std::exp(double(x))));
    const float y = spread(rng, -126, 127.9f, false);
    log = std::max(log, ulps(lane::log(y), std::log(double(y))));
    const float a = spread(rng, -20, 20, false), b = spread(rng, -6, 2.5f);
    pow = std::max(pow, ulps(lane::pow(a, b), std::pow(double(a), double(b))));
    const float p = spread(rng, -30, 30), q = spread(rng, -30, 30);
    atan2 = std::max(atan2, ulps(lane::atan2(p, q), std::atan2(double(p), double(q))));
    const float angle = spread(rng, -20, 26.5f);
    sin = std::max(sin, std::abs(lane::sin(angle) - std::sin(double(angle))));
    cos = std::max(cos, std::abs(lane::cos(angle) - std::cos(double(angle))));
  }
  EXPECT_LT(exp, 1.5);
  EXPECT_LT(log, 1.5);
  EXPECT_LT(pow, 1);
  EXPECT_LT(atan2, 3);
  EXPECT_LT(sin, 1.2e-7);
  EXPECT_LT(cos, 1.2e-7);
}

TEST(LaneMath, EdgesAreFiniteWhereItSaysSo) {
  EXPECT_EQ(lane::exp(0), 1);
  EXPECT_EQ(lane::exp(-200), 0);
  EXPECT_EQ(lane::exp(200), infinite);
  EXPECT_EQ(lane::log(1), 0);
  EXPECT_NEAR(lane::log(0), -87.3365f, 1e-3f);
  EXPECT_EQ(lane::log(-5), lane::log(0));
  EXPECT_EQ(lane::sqrt(-1), 0);
  EXPECT_EQ(lane::divide(3, 0), 0);
  EXPECT_EQ(lane::modulo(-0.25f, 1), 0.75f);
  EXPECT_EQ(lane::modulo(5, 0), 0);
  EXPECT_EQ(lane::modulo(7.5f, -2), -0.5f);
  EXPECT_EQ(lane::pow(0, -2), 0);
  EXPECT_EQ(lane::pow(0, 0), 1);
  EXPECT_EQ(lane::pow(-2, 3), -8);
  EXPECT_EQ(lane::pow(-2, 2), 4);
  EXPECT_EQ(lane::pow(-2, 0.5f), 0);
  EXPECT_EQ(lane::pow(1e30f, 2), infinite);
  EXPECT_EQ(lane::pow(1e-30f, 2), 0);
  EXPECT_EQ(lane::sin(infinite), 0);
  EXPECT_EQ(lane::cos(nan), 1);
  EXPECT_EQ(lane::atan2(0, 0), 0);
  EXPECT_EQ(lane::atan2(0, -1), float(M_PI));
  EXPECT_EQ(lane::smoothstep(0.5f, 0.5f, 0.4f), 0);
  EXPECT_EQ(lane::smoothstep(0.5f, 0.5f, 0.5f), 1);
  EXPECT_EQ(lane::smoothstep(0, 2, 1), 0.5f);
  EXPECT_TRUE(std::isnan(lane::exp(nan)));
}

}  // namespace
}  // namespace dapple::pattern
