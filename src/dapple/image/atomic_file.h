// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <OpenImageIO/filesystem.h>

#include <string>

namespace dapple::image {

/// A file that appears under its name only when it is whole: bytes go to a part beside it, `path`.N.part with a number
/// that no file had, commit() flushes them to the disk and renames. Where `path` is a symbolic link, all that happens
/// beside its target, and the link stays. Destruction without commit removes the part. It is the sink OpenImageIO
/// writes to, so that the first failed write is remembered whether or not a format's library reports it.
class AtomicFile final : public OIIO::Filesystem::IOProxy {
 public:
  explicit AtomicFile(const std::string& path);  ///< IoError if it cannot be made
  ~AtomicFile() override;
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Removes what this process has not finished of `path`, where it is about to end without destructors.
  static void remove_parts_of_process(const std::string& path);

  const std::string& part_path() const { return part_path_; }
  void commit();  ///< IoError if any write failed
  /// Throws IoError for a writer that gave up: with what the system said if a write failed, else with `why`.
  [[noreturn]] void give_up(const std::string& why) const;

  const char* proxytype() const override { return "dapple"; }
  void close() override {}
  size_t write(const void* data, size_t size) override;
  size_t pwrite(const void* data, size_t size, int64_t offset) override;
  size_t size() const override { return static_cast<size_t>(end_); }

 private:
  [[noreturn]] void fail(int error) const;

  const std::string path_, target_;
  std::string part_path_;
  int fd_ = -1;
  int errno_ = 0;  ///< of the first failure
  int64_t end_ = 0;
};

/// What `path` names where it is a symbolic link, be it a file or not yet; else `path`.
std::string link_target(const std::string& path);

/// IoError unless a file could be made at `path`: its folder exists and may be written to, and it names no folder
/// itself.
void check_output_path(const std::string& path);

}  // namespace dapple::image
