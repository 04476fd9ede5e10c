// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "dapple/base/rgb.h"

namespace dapple::scene {

/// Lights by named groups, each of which can have an image of its own: what it lights, directly and indirectly.
struct LightGroups {
  static constexpr size_t max_count = 32;
  /// Group 0 takes lights that name none, and media that glow.
  std::vector<std::string> names{"default"};
  std::vector<uint8_t> of_light;  ///< by light
  /// Factors on what each group gives the picture; none: 1 of each. The film applies them to its sums, and light is of
  /// gains 1 before: only lighting stages of shaders see it with them.
  std::vector<RGB> gains;

  bool has_gains() const {
    return std::any_of(gains.begin(), gains.end(), [](const RGB& gain) { return gain != RGB(1); });
  }
};

}  // namespace dapple::scene
