// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>

namespace dapple {
inline namespace base {

/// Wall-clock seconds since construction.
class Timer {
 public:
  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

double process_cpu_seconds();       ///< User plus system time of this process, all threads.
uint64_t process_peak_rss_bytes();  ///< Largest resident set of this process so far.

}  // namespace base
}  // namespace dapple
