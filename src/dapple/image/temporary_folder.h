// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace dapple::image {

/// A folder of this process alone, removed with all it holds on destruction. Folders that killed processes left behind
/// are removed when the next one is made: a folder whose lock nobody holds is nobody's.
class TemporaryFolder {
 public:
  /// `parent` empty: the system's folder for temporary files. IoError if it cannot be made.
  explicit TemporaryFolder(const std::string& parent);
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  /// Removes those of this process in the system's folder for temporary files, where it is about to end without
  /// destructors.
  static void remove_of_process();

  std::string file(const std::string& name) const { return path_ + "/" + name; }
  const std::string& path() const { return path_; }

 private:
  bool try_make(const std::string& parent);

  std::string path_;
  int lock_ = -1;
};

}  // namespace dapple::image
