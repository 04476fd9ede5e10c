// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <thread>

#include "dapple/base/stop_token.h"

namespace dapple::app {

/// What SIGINT, SIGTERM and SIGHUP do to a rendering; a second of them ends the program at once. Before rendering begins there is nothing to save:
/// the program ends with exit code 130, whatever library is at work. Afterwards the flag is set at once, and the token some tenths of a second
/// later, by which time light work is finished. A program that began with SIGHUP ignored (nohup) goes on to ignore it. One object at a time.
class Interrupts {
 public:
  explicit Interrupts(bool quiet);
  ~Interrupts();

  /// From here on there is an image to save.
  void begin_rendering();
  const std::atomic<bool>& flag() const;
  StopToken abandon() const { return StopToken(abandon_); }

 private:
  enum class Phase { set_up, rendering, ended };

  void watch();

  std::atomic<Phase> phase_{Phase::set_up};
  std::atomic<bool> abandon_{false};
  std::thread watcher_;
};

}  // namespace dapple::app
