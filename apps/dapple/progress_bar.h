// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "dapple/render/render_session.h"

namespace dapple::app {

std::string format_seconds(double seconds);  ///< "0.42 s", "3.1 s", "2:05 min", "1:03:20 h"

/// Shows how far a rendering is: a bar with an estimate of the time left on a terminal, a line every half minute
/// otherwise.
class ProgressBar {
 public:
  explicit ProgressBar(bool enabled);
  void update(const render::Progress& progress);
  void finish();

 private:
  const bool enabled_, terminal_;
  double last_seconds_ = 0;
  bool shown_ = false;
};

}  // namespace dapple::app
