// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace dapple::scene {

/// Lights by named groups, each of which can have an image of its own: what it lights, directly and indirectly.
struct LightGroups {
  static constexpr size_t max_count = 16;
  /// Group 0 takes lights that name none, and media that glow.
  std::vector<std::string> names{"default"};
  std::vector<uint8_t> of_light;  ///< by light
};

}  // namespace dapple::scene
