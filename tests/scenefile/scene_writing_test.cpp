// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/scene_writing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

namespace dapple::scenefile {
namespace {

TEST(SceneWriting, WholeNumbersHaveNoExponent) {
  EXPECT_EQ(text_of(100000.0), "100000");
  EXPECT_EQ(text_of(-300000.0), "-300000");
  EXPECT_EQ(text_of(2147483647.0), "2147483647");
  EXPECT_EQ(text_of(9007199254740992.0), "9007199254740992");
  EXPECT_EQ(text_of(0.0), "0");
}

TEST(SceneWriting, NumbersAreReadBackAsTheyWere) {
  for (const double x : {.1, -0.0, 1e-300, 1e22, 1.5e5, 9007199254740994.0, 1e308, -1e15, 123456.5}) {
    const double read = std::strtod(text_of(x).c_str(), nullptr);
    EXPECT_EQ(read, x);
    EXPECT_EQ(std::signbit(read), std::signbit(x));
  }
}

}  // namespace
}  // namespace dapple::scenefile
