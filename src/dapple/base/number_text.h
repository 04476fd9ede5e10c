// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace dapple {
inline namespace base {

/// A number as messages show it: ten digits at most.
std::string shown(double x);

}  // namespace base
}  // namespace dapple
