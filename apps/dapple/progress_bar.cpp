// SPDX-License-Identifier: Apache-2.0
#include "progress_bar.h"

#include <unistd.h>

#include <cstdio>

#include "dapple/base/log.h"

namespace dapple::app {

namespace {
constexpr double terminal_interval = 0.2, log_interval = 30;
constexpr int bar_width = 30;
}  // namespace

std::string format_seconds(double s) {
  char text[32];
  const int whole = int(s + 0.5);
  if (s < 10)
    std::snprintf(text, sizeof text, "%.2f s", s);
  else if (s < 120)
    std::snprintf(text, sizeof text, "%.1f s", s);
  else if (whole < 3600)
    std::snprintf(text, sizeof text, "%d:%02d min", whole / 60, whole % 60);
  else
    std::snprintf(text, sizeof text, "%d:%02d:%02d h", whole / 3600, whole / 60 % 60, whole % 60);
  return text;
}

ProgressBar::ProgressBar(bool enabled) : enabled_(enabled), terminal_(isatty(STDERR_FILENO) != 0) {}

void ProgressBar::update(const render::Progress& p) {
  if (!enabled_ || p.seconds - last_seconds_ < (terminal_ ? terminal_interval : log_interval)) return;
  last_seconds_ = p.seconds;
  char text[160];
  std::snprintf(text, sizeof text, "%3.0f %%  %u samples a pixel, %s", 100 * p.fraction, p.samples_done,
                p.seconds_left ? (format_seconds(*p.seconds_left) + " left").c_str() : "first pass");
  if (!terminal_) {
    log_info(text);
    return;
  }
  const int filled = std::clamp(int(p.fraction * bar_width), 0, bar_width);
  const std::string bar = std::string(size_t(filled), '#') + std::string(size_t(bar_width - filled), '.');
  std::fprintf(stderr, "\r[%s] %s\033[K", bar.c_str(), text);
  shown_ = true;
}

void ProgressBar::finish() {
  if (shown_) std::fprintf(stderr, "\r\033[K");
}

}  // namespace dapple::app
