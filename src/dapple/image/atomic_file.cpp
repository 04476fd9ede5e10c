// SPDX-License-Identifier: Apache-2.0
#include "dapple/image/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "dapple/base/error.h"

namespace dapple::image {

namespace {
std::string folder_of(const std::string& path) {
  const size_t slash = path.find_last_of('/');
  return slash == std::string::npos ? "." : slash == 0 ? "/" : path.substr(0, slash);
}

/// `path` with its last name cut so that `longest_end` more bytes make a legal one.
std::string stem_of(const std::string& path) {
  constexpr size_t longest_name = 255, longest_end = 32;
  const size_t name = path.find_last_of('/') + 1;  // npos + 1 is 0
  return path.substr(0, name + std::min(path.size() - name, longest_name - longest_end));
}

/// What the names of this process's parts of `target` begin with.
std::string part_stem(const std::string& target) {
  return stem_of(target) + "." + std::to_string(::getpid());
}
}  // namespace

std::string link_target(const std::string& path) {
  constexpr int most_links = 40;  // as Linux follows
  std::filesystem::path p(path);
  std::error_code error;
  for (int i = 0; i < most_links && std::filesystem::is_symlink(p, error); ++i)
    p = p.parent_path() / std::filesystem::read_symlink(p, error);
  return p.string();
}

void check_output_path(const std::string& path) {
  const auto refuse = [&](const std::string& why) { throw IoError("cannot write \"" + path + "\": " + why); };
  if (path.empty()) refuse("the name is empty");
  const std::string target = link_target(path), folder = folder_of(target);
  struct stat s {};
  if (lstat(target.c_str(), &s) == 0 && S_ISLNK(s.st_mode)) refuse(std::strerror(ELOOP));
  if (stat(folder.c_str(), &s) != 0) refuse("folder \"" + folder + "\": " + std::strerror(errno));
  if (!S_ISDIR(s.st_mode)) refuse("\"" + folder + "\" is not a folder");
  if (access(folder.c_str(), W_OK | X_OK) != 0) refuse("folder \"" + folder + "\": " + std::strerror(errno));
  if (stat(path.c_str(), &s) == 0 && !S_ISREG(s.st_mode)) refuse("it exists and is not a plain file");
}

AtomicFile::AtomicFile(const std::string& path) : IOProxy(path, Write), path_(path), target_(link_target(path)) {
  check_output_path(path);
  // Exclusively: a file of that name is somebody's, be it another process that writes to the same file.
  constexpr int attempts = 10000;
  const std::string stem = part_stem(target_);
  for (int i = 0; fd_ < 0 && i < attempts; ++i) {
    part_path_ = stem + (i > 0 ? "-" + std::to_string(i) : "") + ".part";
    fd_ = ::open(part_path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (fd_ < 0 && errno != EEXIST) break;
  }
  if (fd_ < 0) fail(errno);
}

void AtomicFile::remove_parts_of_process(const std::string& path) {
  const std::string stem = part_stem(link_target(path));
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder_of(stem), ignored)) {
    const std::string name = entry.path().filename().string(), begin = stem.substr(stem.find_last_of('/') + 1);
    if (name.starts_with(begin) && name.ends_with(".part") && (name[begin.size()] == '.' || name[begin.size()] == '-'))
      std::filesystem::remove(entry.path(), ignored);
  }
}

AtomicFile::~AtomicFile() {
  if (fd_ < 0) return;
  ::close(fd_);
  ::unlink(part_path_.c_str());
}

size_t AtomicFile::pwrite(const void* data, size_t size, int64_t offset) {
  if (errno_) return 0;
  const char* from = static_cast<const char*>(data);
  size_t done = 0;
  while (done < size) {
    const ssize_t n = ::pwrite(fd_, from + done, size - done, offset + static_cast<int64_t>(done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      errno_ = n < 0 ? errno : EIO;
      break;
    }
    done += static_cast<size_t>(n);
  }
  end_ = std::max(end_, offset + static_cast<int64_t>(done));
  return done;
}

size_t AtomicFile::write(const void* data, size_t size) {
  const size_t done = pwrite(data, size, m_pos);
  m_pos += static_cast<int64_t>(done);
  return done;
}

void AtomicFile::commit() {
  if (!errno_ && ::fsync(fd_) != 0 && errno != EINVAL) errno_ = errno;
  if (errno_) fail(errno_);
  if (::rename(part_path_.c_str(), target_.c_str()) != 0) fail(errno);
  ::close(fd_);
  fd_ = -1;
  // The new name must outlast a power cut, too; a file system that cannot promise it is no failure of ours.
  const int folder = ::open(folder_of(target_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return;
  ::fsync(folder);
  ::close(folder);
}

void AtomicFile::give_up(const std::string& why) const {
  if (errno_) fail(errno_);
  throw IoError("cannot write \"" + path_ + "\": " + why);
}

void AtomicFile::fail(int error) const {
  throw IoError("cannot write \"" + path_ + "\": " + std::strerror(error));
}

}  // namespace dapple::image
