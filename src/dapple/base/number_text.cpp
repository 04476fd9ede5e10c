// SPDX-License-Identifier: Apache-2.0
#include "dapple/base/number_text.h"

#include <cstdio>

namespace dapple {
inline namespace base {

std::string shown(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.10g", x);
  return text;
}

}  // namespace base
}  // namespace dapple
