// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "dapple/base/stop_token.h"

namespace dapple::app {

/// What SIGINT, SIGTERM and SIGHUP do to a command. While it works towards its first result there is nothing to save:
/// the program ends with exit code 130, whatever library is at work. While an image is rendered the flag is set at
/// once, and the token some tenths of a second later, by which time light work is finished. Files that are being
/// written are completed first. A second signal ends the program at once, without its unfinished files. A program that
/// began with SIGHUP ignored (nohup) goes on to ignore it. One object at a time.
class Interrupts {
 public:
  /// `result` is what there is none of when work ends early, "image"; quiet commands do not say what they wait for.
  explicit Interrupts(std::string result, bool quiet = false);
  ~Interrupts();

  /// From here on there is an image to save.
  void begin_rendering();
  /// From here on to end_writing(), or the object's end, these files are being written; empty names are none.
  void begin_writing(std::vector<std::string> paths);
  /// Back to work, if no signal came meanwhile.
  void end_writing();

  const std::atomic<bool>& flag() const;
  StopToken abandon() const { return StopToken(abandon_); }

 private:
  enum class Phase { working, rendering, writing, ended };

  void watch();
  bool take_from_work(Phase to);
  [[noreturn]] void end_program() const;
  void remove_parts();

  const std::string result_;
  const bool quiet_;
  std::atomic<Phase> phase_{Phase::working};
  std::atomic<bool> abandon_{false};
  std::atomic<int> written_{0};  ///< files
  std::mutex mutex_;
  std::vector<std::string> paths_;  ///< being written
  std::thread watcher_;
};

}  // namespace dapple::app
