// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "dapple/base/error.h"

namespace dapple::scenefile {

/// The folder in which a file is named; empty: none.
std::string directory_of(const std::string& path);

/// Opens a regular file for reading; the descriptor is the caller's. InputError at `loc` for directories, devices,
/// pipes, and what cannot be read.
int open_regular_file(const std::string& path, const FileLoc& loc, uint64_t* bytes);

/// The whole contents of a regular file: read, beyond `most_read` bytes mapped into memory, or inflated if it is gzip
/// (by its first bytes, not by its name). So one that becomes shorter while it is read is an InputError; one so large
/// that it is mapped must stay as it is. Directories, devices and pipes are refused. Inflated text may be at most 16
/// MiB plus 32 times the file's size, so that a small hostile file cannot fill the memory.
class FileSource {
 public:
  static constexpr size_t most_read = size_t(64) << 20;

  /// InputError at `loc` (where the file is named) if it cannot be read.
  FileSource(const std::string& path, const FileLoc& loc);
  ~FileSource();
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;

  std::string_view contents() const { return contents_; }
  /// Whether contents() are the file's own pages.
  bool is_mapped() const { return mapping_ != nullptr; }
  /// Bytes on the disk.
  size_t stored_bytes() const { return stored_bytes_; }

  /// The same for two names of one file.
  struct Identity {
    uint64_t device = 0, number = 0;
    friend bool operator==(const Identity&, const Identity&) = default;
  };
  Identity identity() const { return identity_; }

 private:
  void unmap();

  void* mapping_ = nullptr;
  size_t stored_bytes_ = 0;
  std::unique_ptr<char[]> read_;
  std::string inflated_;
  std::string_view contents_;
  Identity identity_;
};

/// Inflates gzip data (one or more members). InputError at `loc`, naming `path`, if it is damaged, larger than above,
/// or followed by anything but zeros.
std::string inflate_gzip(std::string_view data, const std::string& path, const FileLoc& loc);

}  // namespace dapple::scenefile
