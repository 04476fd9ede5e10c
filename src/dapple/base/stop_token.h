// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <exception>

namespace dapple {
inline namespace base {

/// Work was given up because its StopToken said so. No Error: nothing is wrong.
class Stopped : public std::exception {
 public:
  const char* what() const noexcept override { return "stopped"; }
};

/// Says to long work that its result is no longer wanted. A copy refers to the same flag, which must outlive all
/// copies; a token without one never stops. What a thread has seen to be stopped is so for all that it tells of it: the
/// flag is not to be reset meanwhile.
class StopToken {
 public:
  StopToken() = default;
  explicit StopToken(const std::atomic<bool>& flag) : flag_(&flag) {}
  bool stopped() const { return flag_ && flag_->load(std::memory_order_relaxed); }
  /// Throws Stopped.
  void check() const {
    if (stopped()) throw Stopped();
  }

 private:
  const std::atomic<bool>* flag_ = nullptr;
};

}  // namespace base
}  // namespace dapple
