// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/file_source.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include "dapple/scenefile/text.h"

namespace dapple::scenefile {

namespace {

constexpr size_t max_path_in_message = 400;

[[noreturn]] void cannot_read(const std::string& path, const FileLoc& loc, const std::string& why) {
  throw InputError(loc, "cannot read " + in_quotes(path, max_path_in_message) + ": " + why);
}

struct Descriptor {
  int fd;
  ~Descriptor() {
    if (fd >= 0) close(fd);
  }
};

struct Inflater {
  z_stream stream{};
  // 15 + 16: the largest window, gzip framing only.
  Inflater() { ok = inflateInit2(&stream, 15 + 16) == Z_OK; }
  ~Inflater() { inflateEnd(&stream); }
  bool ok = false;
};

bool is_gzip(std::string_view data) {
  return data.size() >= 2 && data[0] == '\x1f' && data[1] == '\x8b';
}

}  // namespace

std::string directory_of(const std::string& path) {
  const size_t slash = path.rfind('/');
  return slash == std::string::npos ? std::string() : path.substr(0, std::max<size_t>(slash, 1));
}

std::string inflate_gzip(std::string_view data, const std::string& path, const FileLoc& loc) {
  constexpr size_t chunk = size_t(1) << 20;
  const size_t limit = (size_t(16) << 20) + 32 * data.size();
  Inflater inflater;
  if (!inflater.ok) cannot_read(path, loc, "no memory to decompress it");
  z_stream& z = inflater.stream;
  std::string out;
  size_t used = 0;
  const auto* next = reinterpret_cast<const Bytef*>(data.data());
  size_t left = data.size();
  for (;;) {
    if (out.size() < used + chunk) out.resize(std::max(used + chunk, out.size() + out.size() / 2));
    const uInt in = uInt(std::min<size_t>(left, 1u << 30)), room = uInt(std::min<size_t>(out.size() - used, 1u << 30));
    z.next_in = const_cast<Bytef*>(next), z.avail_in = in;
    z.next_out = reinterpret_cast<Bytef*>(out.data() + used), z.avail_out = room;
    const int status = inflate(&z, Z_NO_FLUSH);
    next += in - z.avail_in, left -= in - z.avail_in, used += room - z.avail_out;
    if (used > limit) cannot_read(path, loc, "it decompresses to an implausible size");
    if (status == Z_STREAM_END) {
      // Members may be concatenated; behind the last one zeros may stand, as tapes and tar leave them.
      const std::string_view rest(reinterpret_cast<const char*>(next), left);
      if (!is_gzip(rest)) {
        if (rest.find_first_not_of('\0') == std::string_view::npos) break;
        cannot_read(path, loc,
                    "behind its compressed data stand " + std::to_string(left) + " bytes that are not compressed");
      }
      inflateReset(&z);
    } else if (status != Z_OK) {
      cannot_read(path, loc,
                  status == Z_BUF_ERROR ? "its compressed data end too early" : "its compressed data are damaged");
    }
  }
  out.resize(used);
  return out;
}

namespace {

int open_regular(const std::string& path, const FileLoc& loc, struct stat* info) {
  if (path.find('\0') != std::string::npos) cannot_read(path, loc, "its name holds a zero byte");
  // Non-blocking, because opening a pipe nobody writes to would wait for ever.
  Descriptor file{open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
  if (file.fd < 0 || fstat(file.fd, info) != 0) cannot_read(path, loc, std::generic_category().message(errno));
  if (S_ISDIR(info->st_mode)) cannot_read(path, loc, "it is a directory; expected a regular file");
  if (!S_ISREG(info->st_mode)) cannot_read(path, loc, "it is not a regular file");
  return std::exchange(file.fd, -1);
}

void read_all(int fd, const std::string& path, const FileLoc& loc, char* out, size_t bytes) {
  for (size_t done = 0; done < bytes;) {
    const ssize_t got = pread(fd, out + done, bytes - done, off_t(done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) cannot_read(path, loc, std::generic_category().message(errno));
    if (got == 0) cannot_read(path, loc, "it has become shorter while it was read");
    done += size_t(got);
  }
}

}  // namespace

int open_regular_file(const std::string& path, const FileLoc& loc, uint64_t* bytes) {
  struct stat info {};
  const int fd = open_regular(path, loc, &info);
  *bytes = uint64_t(std::max<off_t>(info.st_size, 0));
  return fd;
}

FileSource::FileSource(const std::string& path, const FileLoc& loc) {
  struct stat info {};
  const Descriptor file{open_regular(path, loc, &info)};
  identity_ = {uint64_t(info.st_dev), uint64_t(info.st_ino)};
  if (info.st_size <= 0) return;
  stored_bytes_ = size_t(info.st_size);
  if (stored_bytes_ <= most_read) {
    read_.reset(new char[stored_bytes_]);  // not to be set to zero first
    read_all(file.fd, path, loc, read_.get(), stored_bytes_);
    contents_ = {read_.get(), stored_bytes_};
  } else {
    mapping_ = mmap(nullptr, stored_bytes_, PROT_READ, MAP_PRIVATE | MAP_POPULATE, file.fd, 0);
    if (mapping_ == MAP_FAILED) {
      mapping_ = nullptr;
      cannot_read(path, loc, std::generic_category().message(errno));
    }
    contents_ = {static_cast<const char*>(mapping_), stored_bytes_};
  }
  if (!is_gzip(contents_)) return;
  try {
    inflated_ = inflate_gzip(contents_, path, loc);
  } catch (...) {
    unmap();
    throw;
  }
  unmap();
  read_.reset();
  contents_ = inflated_;
}

void FileSource::unmap() {
  if (mapping_) munmap(mapping_, stored_bytes_);
  mapping_ = nullptr;
}

FileSource::~FileSource() {
  unmap();
}

}  // namespace dapple::scenefile
