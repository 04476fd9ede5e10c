// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace dapple::app {

struct SequenceOptions {
  std::string frames, output;  ///< FramePattern
  std::string range;           ///< FrameRange; empty: all that are there
  int step = 0;                ///< 0: 1 with a range, else the smallest between frames that are there
  int neighbours = 0;          ///< before, and after
  std::string weights;
  bool quiet = false;
};

/// dapple denoise --frames: the exit code.
int denoise_sequence(const SequenceOptions& options);

}  // namespace dapple::app
