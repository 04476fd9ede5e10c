// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>

#include "dapple/base/rgb.h"

namespace dapple::gi {

/// A number >= 0 in 16 bits: 6 bits of exponent, 10 of mantissa. From 2^-31 (below: zero) to 2^33 (above: that);
/// relative error at most 2^-11. NaN and negative numbers are zero. Half floats, with 5 bits of exponent, end at 65504:
/// light in a sunlit scene, in its units, may be more.
constexpr uint16_t pack(float value) {
  constexpr uint32_t smallest = 96u << 10;  // 2^-31, above the 13 bits of mantissa that are dropped
  if (!(value >= 0x1p-31f)) return 0;
  if (value >= 0x1.ff8p32f) return 0xffff;
  const uint32_t rounded = std::bit_cast<uint32_t>(value) + (1u << 12);
  return uint16_t((rounded >> 13) - smallest + 1);
}

constexpr float unpack(uint16_t packed) {
  constexpr uint32_t smallest = 96u << 10;
  return packed == 0 ? 0 : std::bit_cast<float>((packed - 1 + smallest) << 13);
}

}  // namespace dapple::gi
