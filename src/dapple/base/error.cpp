// SPDX-License-Identifier: Apache-2.0
#include "dapple/base/error.h"

#include "dapple/base/log.h"

namespace dapple {
inline namespace base {

namespace {
// Beyond this many warnings a hostile file would fill memory with messages.
constexpr size_t max_messages = 1000;
// Names quoted from input files may be megabytes long.
constexpr size_t max_message_length = 600;

std::string shorten(std::string s) {
  if (s.size() > max_message_length) s = s.substr(0, max_message_length) + "...";
  return s;
}
}  // namespace

std::string FileLoc::to_string() const {
  std::string s(file.empty() ? std::string_view("<input>") : file);
  if (line) s += ":" + std::to_string(line);
  if (line && column) s += ":" + std::to_string(column);
  return s;
}

InputError::InputError(const FileLoc& loc, const std::string& message)
    : Error(ExitCode::bad_input, loc.to_string() + ": " + shorten(message)) {}

InputError::InputError(const InputError& inner, const FileLoc& included_at)
    : Error(ExitCode::bad_input, shorten(inner.what()) + " (included at " + included_at.to_string() + ")") {}

void Diagnostics::warn(const FileLoc& loc, const std::string& message, const std::string& key) {
  if (strict_) throw InputError(loc, message);
  const std::lock_guard lock(mutex_);
  if (!key.empty() && !keys_.insert(key).second) return;
  if (messages_.size() > max_messages) return;
  if (messages_.size() == max_messages) {
    messages_.push_back("further warnings are not shown");
  } else {
    messages_.push_back(loc.to_string() + ": " + shorten(message));
  }
  if (logs_) log_warning(messages_.back());
}

void Diagnostics::unsupported(const FileLoc& loc, const std::string& what, const std::string& stand_in) {
  warn(loc, what + " is not supported; rendered as " + stand_in, "unsupported " + what);
  const std::lock_guard lock(mutex_);
  if (keys_.insert("listed " + what).second && unsupported_.size() < max_messages)
    unsupported_.push_back(shorten(what + " (rendered as " + stand_in + ")"));
}

size_t Diagnostics::count() const {
  const std::lock_guard lock(mutex_);
  return messages_.size();
}

std::vector<std::string> Diagnostics::messages() const {
  const std::lock_guard lock(mutex_);
  return messages_;
}

std::vector<std::string> Diagnostics::unsupported_features() const {
  const std::lock_guard lock(mutex_);
  return unsupported_;
}

std::string one_of(const std::vector<std::string_view>& names) {
  if (names.empty()) return "there is none";
  std::string s = "expected one of: ";
  for (size_t i = 0; i < names.size(); ++i) s.append(i ? ", " : "").append(names[i]);
  return s;
}

}  // namespace base
}  // namespace dapple
