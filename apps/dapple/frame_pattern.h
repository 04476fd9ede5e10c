// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace dapple::app {

/// Names of frames: "shots/a.####.exr", with the frame's number, of at least as many digits, in place of the signs.
class FramePattern {
 public:
  /// UsageError, naming the option, unless there is one run of "#", in the file's name.
  FramePattern(const std::string& option, const std::string& text);

  std::string path(int frame) const;
  /// Numbers of the frames whose files are there, rising. IoError where the folder cannot be read.
  std::vector<int> existing() const;

 private:
  std::string text_, before_, after_;
  size_t digits_ = 0;
};

/// "10-20" or "7". UsageError, naming the option, where it is anything else or runs backwards.
struct FrameRange {
  int first = 0, last = 0;
  FrameRange(const std::string& option, const std::string& text);
};

}  // namespace dapple::app
