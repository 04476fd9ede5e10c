// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace dapple {
inline namespace base {

/// Where an item of an input file stands. `file` points into storage owned by whoever read the file
/// (SceneDescription keeps its file names alive). line and column count from 1; 0 means unknown.
struct FileLoc {
  std::string_view file;
  uint32_t line = 0;
  uint32_t column = 0;

  std::string to_string() const;  ///< "file:line:column", as far as known.
};

/// Exit codes of the command line (DESIGN section 5).
enum class ExitCode { done = 0, usage = 2, bad_input = 3, io = 4, memory = 5, interrupted = 130 };

/// Base of all errors Dapple throws on purpose. what() is a complete message for the user.
class Error : public std::runtime_error {
 public:
  Error(ExitCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  ExitCode code() const { return code_; }

 private:
  ExitCode code_;
};

/// The user's command or options are wrong.
class UsageError : public Error {
 public:
  explicit UsageError(const std::string& message) : Error(ExitCode::usage, message) {}
};

/// A scene, mesh or image is wrong. The message begins with the location.
class InputError : public Error {
 public:
  InputError(const FileLoc& loc, const std::string& message);
  /// `inner`, and after it where the file that it is about was named.
  InputError(const InputError& inner, const FileLoc& included_at);
};

/// An output could not be written.
class IoError : public Error {
 public:
  explicit IoError(const std::string& message) : Error(ExitCode::io, message) {}
};

/// Geometry or images need more memory than allowed.
class MemoryError : public Error {
 public:
  explicit MemoryError(const std::string& message) : Error(ExitCode::memory, message) {}
};

/// Collects what is wrong but survivable, and names each thing once. Thread-safe. In strict mode a warning
/// throws InputError instead.
class Diagnostics {
 public:
  /// `logs`: warnings are logged as they are reported, not kept alone.
  explicit Diagnostics(bool strict = false, bool logs = true) : strict_(strict), logs_(logs) {}

  /// Reports `message` at `loc`. Warnings with an equal non-empty key are reported for the first place only.
  void warn(const FileLoc& loc, const std::string& message, const std::string& key = {});
  /// Reports that a feature is replaced: "<what> is not supported; rendered as <stand_in>". Keyed by `what`;
  /// listed by `dapple info`.
  void unsupported(const FileLoc& loc, const std::string& what, const std::string& stand_in);

  bool strict() const { return strict_; }
  size_t count() const;
  std::vector<std::string> messages() const;
  std::vector<std::string> unsupported_features() const;

 private:
  const bool strict_, logs_;
  mutable std::mutex mutex_;
  std::set<std::string> keys_;
  std::vector<std::string> messages_;
  std::vector<std::string> unsupported_;
};

/// "expected one of: a, b, c" for messages about unknown names, in this order; "there is none" where there are none.
std::string one_of(const std::vector<std::string_view>& names);

}  // namespace base
}  // namespace dapple
