// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>

namespace dapple {
inline namespace base {

inline constexpr double degree = std::numbers::pi / 180;  ///< radians

}  // namespace base
}  // namespace dapple
