// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace dapple::app {

/// The files that a command is going to write, known before it works: none may be another one, nor a file that the
/// command reads. Two names of one file (links, "./") count as one.
class OutputFiles {
 public:
  /// Of an option; an empty path is an option that was not given. UsageError if it is an output already, IoError if it
  /// cannot be written.
  void add(const std::string& option, const std::string& path);
  /// The same, and UsageError unless it is named as an image.
  void add_image(const std::string& option, const std::string& path);
  /// The image that a scene file names at `place`, "file:line:column": InputError where it is a file that is read.
  void add_image_of_scene(const std::string& path, const std::string& place);

  /// UsageError if `path`, which the command reads, is one of the outputs. Names of no file are no matter.
  void check_input(const std::string& path) const;
  void check_inputs(const std::vector<std::string>& paths) const;

 private:
  struct Output {
    std::string what, path, place;
  };
  using Identity = std::pair<uint64_t, uint64_t>;  ///< device and number
  static std::optional<Identity> identity(const std::string& path);
  std::map<Identity, const Output*> existing() const;
  void check_input(const std::string& path, const std::map<Identity, const Output*>& existing) const;
  void add(Output output);

  std::map<std::string, Output> by_name_;
};

}  // namespace dapple::app
