// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>

namespace dapple::modelfile {

/// What a child process may use.
struct ChildLimits {
  uint64_t memory_bytes = uint64_t(4) << 30;  ///< beyond what this process has mapped
  double seconds = 60;                        ///< of computing; four times as much by the clock
  uint64_t result_bytes = uint64_t(4) << 30;
};

/// Why a child gave no result: it crashed, took too long, too much memory or returned too much.
class ChildFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Runs `work` in a copy of this process and returns what it returns there. Nothing else comes back: the copy has no
/// output, may write no file, ends with this process, and has limits on memory and time. So code that may crash or run
/// away on hostile data may run in `work`, as long as it needs no lock that another thread may hold: memory may be
/// allocated, threads not started. An exception in `work` is a std::runtime_error with its text here. ChildFailure
/// where there is no result. Memory limits do not hold with the address sanitizer, whose shadow has no bounds.
std::string run_in_child(const std::function<std::string()>& work, const ChildLimits& limits);

}  // namespace dapple::modelfile
