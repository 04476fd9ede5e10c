// SPDX-License-Identifier: Apache-2.0
#include "dapple/depthimage/fragment.h"

namespace dapple::depthimage {

namespace {

float sign_of(float x) {
  return x < 0 ? -1.0f : 1.0f;
}

}  // namespace

uint16_t encode_normal(const V3f& n) {
  const float sum = std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
  if (!(sum > 0)) return encode_normal({0, 0, 1});
  float x = n.x / sum, y = n.y / sum;
  if (n.z < 0) {
    const float folded = (1 - std::abs(y)) * sign_of(x);
    y = (1 - std::abs(x)) * sign_of(y);
    x = folded;
  }
  const auto code = [](float v) { return unsigned(std::lround((std::clamp(v, -1.0f, 1.0f) + 1) * 127)); };
  return uint16_t(code(x) | code(y) << 8);
}

V3f decode_normal(uint16_t code) {
  float x = float(code & 255) / 127 - 1, y = float(code >> 8) / 127 - 1;
  const float z = 1 - std::abs(x) - std::abs(y);
  if (z < 0) {
    const float folded = (1 - std::abs(y)) * sign_of(x);
    y = (1 - std::abs(x)) * sign_of(y);
    x = folded;
  }
  const V3f n(x, y, z);
  return n * (1 / length(n));
}

}  // namespace dapple::depthimage
