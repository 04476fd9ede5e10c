// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace dapple {
inline namespace base {

/// Messages to the user, on standard error, one line each, with a time stamp only where output is not a terminal.
/// Thread-safe. Nothing per sample or per ray may log.
void log_info(std::string_view message);
void log_warning(std::string_view message);
void log_error(std::string_view message);

/// 0 errors only, 1 also warnings, 2 also information (default).
void set_log_level(int level);

}  // namespace base
}  // namespace dapple
