// SPDX-License-Identifier: Apache-2.0
#include "frame_pattern.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <optional>

#include "dapple/base/error.h"

namespace dapple::app {

namespace {

constexpr int most_frames = 100'000;

/// All of the text as a number of at most nine digits.
std::optional<int> number(std::string_view text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = error == std::errc() && end == text.data() + text.size() && text.size() <= 9;
  return whole && value >= 0 ? std::optional(value) : std::nullopt;
}

}  // namespace

FramePattern::FramePattern(const std::string& option, const std::string& text) : text_(text) {
  const size_t first = text.find('#'), last = text.find_last_of('#');
  if (first != std::string::npos) {
    digits_ = last + 1 - first;
    before_ = text.substr(0, first), after_ = text.substr(last + 1);
  }
  if (first == std::string::npos || text.find_first_not_of('#', first) < last ||
      after_.find('/') != std::string::npos || digits_ > 9)
    throw UsageError(option + " is \"" + text +
                     "\"; expected one run of \"#\" in the file's name, where the frame's number is: shot.####.exr");
}

std::string FramePattern::path(int frame) const {
  const std::string digits = std::to_string(frame);
  return before_ + std::string(digits_ - std::min(digits_, digits.size()), '0') + digits + after_;
}

std::vector<int> FramePattern::existing() const {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(before_).parent_path();
  const std::string begin = fs::path(before_).filename().string();
  std::error_code error;
  std::vector<int> frames;
  fs::directory_iterator entry(folder.empty() ? "." : folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (name.size() < begin.size() + digits_ + after_.size() || !name.starts_with(begin) || !name.ends_with(after_))
      continue;
    const auto frame = number(std::string_view(name).substr(begin.size(), name.size() - begin.size() - after_.size()));
    if (frame && fs::path(path(*frame)).filename() == name) frames.push_back(*frame);
  }
  if (error) throw IoError("cannot look for \"" + text_ + "\": " + error.message());
  std::sort(frames.begin(), frames.end());
  return frames;
}

FrameRange::FrameRange(const std::string& option, const std::string& text) {
  const size_t dash = text.find('-');
  const auto a = number(std::string_view(text).substr(0, dash)),
             b = dash == std::string::npos ? a : number(std::string_view(text).substr(dash + 1));
  if (!a || !b || *b < *a || *b - *a >= most_frames)
    throw UsageError(option + " is \"" + text + "\"; expected the first and the last frame, at most " +
                     std::to_string(most_frames) + " of them: 10-20");
  first = *a, last = *b;
}

}  // namespace dapple::app
