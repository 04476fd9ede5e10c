// SPDX-License-Identifier: Apache-2.0
#include "dapple/image/temporary_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "dapple/base/error.h"

namespace dapple::image {

namespace {

namespace fs = std::filesystem;

constexpr const char* prefix = "dapple-textures-";
constexpr const char* lock_name = "/lock";

/// Opens and locks a folder's lock file; -1 if there is none or another process holds it.
int take_lock(const std::string& folder, int flags) {
  const int fd = ::open((folder + lock_name).c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | flags, 0600);
  if (fd < 0) return -1;
  struct stat s {};
  // A folder swept away between the two calls has no link to its lock any more.
  if (::flock(fd, LOCK_EX | LOCK_NB) == 0 && ::fstat(fd, &s) == 0 && s.st_nlink > 0) return fd;
  ::close(fd);
  return -1;
}

void sweep(const std::string& parent) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(parent, ignored)) {
    const std::string path = entry.path().string();
    struct stat s {};
    if (!entry.path().filename().string().starts_with(prefix) || ::lstat(path.c_str(), &s) != 0 ||
        !S_ISDIR(s.st_mode) || s.st_uid != ::geteuid())
      continue;
    const int lock = take_lock(path, 0);
    if (lock < 0) continue;
    fs::remove_all(path, ignored);
    ::close(lock);
  }
}

}  // namespace

bool TemporaryFolder::try_make(const std::string& parent) {
  path_ = parent + "/" + prefix + std::to_string(::getpid()) + "-XXXXXX";
  if (!::mkdtemp(path_.data()))
    throw IoError("cannot make a folder for temporary files in \"" + parent + "\": " + std::strerror(errno) +
                  "; set TMPDIR to a folder that can be written to");
  lock_ = take_lock(path_, O_CREAT | O_EXCL);
  return lock_ >= 0;
}

TemporaryFolder::TemporaryFolder(const std::string& parent) {
  std::error_code error;
  const std::string where = parent.empty() ? fs::temp_directory_path(error).string() : parent;
  if (error) throw IoError("there is no folder for temporary files: " + error.message() + "; set TMPDIR");
  sweep(where);
  for (int attempt = 0; attempt < 10; ++attempt)
    if (try_make(where)) return;
  throw IoError("cannot lock a folder for temporary files in \"" + where + "\"");
}

void TemporaryFolder::remove_of_process() {
  std::error_code ignored;
  const std::string own = prefix + std::to_string(::getpid()) + "-";
  for (const fs::directory_entry& entry : fs::directory_iterator(fs::temp_directory_path(ignored), ignored))
    if (entry.path().filename().string().starts_with(own)) fs::remove_all(entry.path(), ignored);
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
  if (lock_ >= 0) ::close(lock_);
}

}  // namespace dapple::image
