// SPDX-License-Identifier: Apache-2.0
#include "dapple/base/input_file.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace dapple {
inline namespace base {

std::string why_unreadable(const std::string& path) {
  struct stat s {};
  if (path.find('\0') != std::string::npos) return "its name holds a zero byte";
  if (stat(path.c_str(), &s) != 0) return std::strerror(errno);
  if (S_ISDIR(s.st_mode)) return "it is a directory";
  if (!S_ISREG(s.st_mode)) return "it is not a regular file";
  return access(path.c_str(), R_OK) == 0 ? "" : std::strerror(errno);
}

}  // namespace base
}  // namespace dapple
