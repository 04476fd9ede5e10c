// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>

#include "dapple/base/rgb.h"
#include "dapple/base/vec.h"

namespace dapple::depthimage {

/// Samples of a texel: `side` by `side`, at the middles of so many squares. Bit `side * row + column` of a mask.
struct SampleMask {
  static constexpr int side = 4, count = side * side;

  /// Mean place of the samples of a mask that is not 0, in texels from the texel's corner.
  static V2f centroid(uint16_t mask) {
    constexpr float column_sum[16] = {0, 0.5f, 1.5f, 2, 2.5f, 3, 4, 4.5f, 3.5f, 4, 5, 5.5f, 6, 6.5f, 7.5f, 8};
    float x = 0, y = 0;
    for (int row = 0; row < side; ++row) {
      const unsigned bits = mask >> (row * side) & 15u;
      x += column_sum[bits];
      y += (float(row) + 0.5f) * float(std::popcount(bits));
    }
    const float scale = 1 / (float(side) * float(std::popcount(unsigned(mask))));
    return {x * scale, y * scale};
  }
};

/// Unit vectors in 8 + 8 bits on an octahedron (Meyer et al. 2010), within a degree.
uint16_t encode_normal(const V3f& n);
V3f decode_normal(uint16_t code);

/// A part of a colour's largest value in 8 bits, even in its square root.
inline uint8_t encode_share(float value, float largest) {
  return largest > 0 ? uint8_t(std::lround(255 * std::sqrt(std::clamp(value / largest, 0.0f, 1.0f)))) : 0;
}
inline float decode_share(uint8_t code, float largest) {
  return largest * sqr(float(code) * (1 / 255.0f));
}

/// A piece of surface as a texel of an image sees it: one entry of an A-buffer (Carpenter 1984; Max 1996).
struct Fragment {
  uint16_t depth = 0;                             ///< of the mask's centroid, front to back over the object's diameter
  uint16_t mask = 0;                              ///< samples that it covers
  uint16_t plane_normal = 0, shading_normal = 0;  ///< encode_normal(), object space
  uint8_t reflectance[3] = {}, transmittance[3] = {};  ///< encode_share() of ImageMaterial's
  uint8_t material = 0, reserved = 0;
};
static_assert(sizeof(Fragment) == 16);

}  // namespace dapple::depthimage
