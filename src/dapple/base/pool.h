// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace dapple {
inline namespace base {

/// Scratch that is dear to make, lent to one task at a time: as many as tasks ever ran at once. Which of them a task
/// gets must change nothing.
template <class T>
class Pool {
 public:
  /// One that is idle, else make(): a std::unique_ptr<T>.
  template <class Make>
  std::unique_ptr<T> take(Make make) {
    {
      const std::lock_guard lock(mutex_);
      if (!idle_.empty()) {
        std::unique_ptr<T> taken = std::move(idle_.back());
        idle_.pop_back();
        return taken;
      }
    }
    return make();
  }
  void give(std::unique_ptr<T> back) {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(back));
  }
  /// All that were given back. Not while tasks run.
  const std::vector<std::unique_ptr<T>>& idle() const { return idle_; }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<T>> idle_;
};

}  // namespace base
}  // namespace dapple
