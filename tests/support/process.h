// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace dapple::test {

/// A folder of its own for a test's files, removed with all it holds.
class ScratchFolder {
 public:
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

struct ProcessResult {
  int exit_code = -1;      ///< -1 where a signal ended the process
  int signal = 0;          ///< the signal that ended it, 0 for none
  bool timed_out = false;  ///< killed by wait()
  double seconds = 0;
  double processor_seconds = 0;  ///< of all threads
  uint64_t peak_rss_bytes = 0;   ///< the kernel's figure: at least the test's own size when it started the process
  std::string output;            ///< standard output and standard error as they came
};

/// A child process with its output in a file, so that it never waits for its reader.
class Process {
 public:
  /// Starts arguments[0] (a path) in the folder `directory`; std::system_error where it cannot.
  explicit Process(const std::vector<std::string>& arguments, const std::string& directory = ".");
  ~Process();  ///< Kills it if it still runs.
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void send(int signal);
  /// Waits until it answers the signal by code of its own: before, a program is still being loaded. False where it
  /// ended or took `timeout` seconds.
  bool wait_until_it_answers(int signal, double timeout) const;
  std::string output() const;  ///< so far
  /// Waits for its end, and kills it after `timeout` seconds.
  ProcessResult wait(double timeout);

 private:
  ScratchFolder folder_;
  int pid_ = -1;
  double start_ = 0;
};

/// Starts a process and waits for it.
ProcessResult run_process(const std::vector<std::string>& arguments, double timeout,
                          const std::string& directory = ".");

}  // namespace dapple::test
