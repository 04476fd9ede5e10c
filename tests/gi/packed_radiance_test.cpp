// SPDX-License-Identifier: Apache-2.0
#include "dapple/gi/packed_radiance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace dapple::gi {
namespace {

TEST(PackedRadiance, IsWithinHalfAStepOverItsRange) {
  for (double e = -31; e < 32.99; e += 0.00037) {
    const float value = float(std::exp2(e));
    ASSERT_LE(std::abs(unpack(pack(value)) / value - 1.0), 0x1p-11) << value;
  }
}

TEST(PackedRadiance, EveryCodeComesBack) {
  for (uint32_t code = 0; code < 65536; ++code) ASSERT_EQ(pack(unpack(uint16_t(code))), code);
}

TEST(PackedRadiance, WhatItCannotHold) {
  for (const float zero : {0.0f, -0.0f, -1.0f, 0x1p-32f, 1e-40f, std::numeric_limits<float>::quiet_NaN()})
    EXPECT_EQ(pack(zero), 0) << zero;
  for (const float huge : {1e30f, std::numeric_limits<float>::infinity()}) EXPECT_EQ(pack(huge), 0xffff) << huge;
}

}  // namespace
}  // namespace dapple::gi
