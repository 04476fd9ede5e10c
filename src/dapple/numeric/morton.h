// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace dapple {

/// The low 21 bits of x, two empty bits above each: three of these, shifted by 0, 1 and 2, are a place along Morton's
/// curve through a cube.
constexpr uint64_t spread_bits_by_3(uint64_t x) {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x001f00000000ffff;
  x = (x | x << 16) & 0x001f0000ff0000ff;
  x = (x | x << 8) & 0x100f00f00f00f00f;
  x = (x | x << 4) & 0x10c30c30c30c30c3;
  return (x | x << 2) & 0x1249249249249249;
}

}  // namespace dapple
