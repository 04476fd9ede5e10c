// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace dapple {
inline namespace base {

/// Why `path` is no file to read, as messages say it; empty if it is one. To be asked before it is opened: a pipe would
/// wait for a writer.
std::string why_unreadable(const std::string& path);

}  // namespace base
}  // namespace dapple
