// SPDX-License-Identifier: Apache-2.0
#include "output_files.h"

#include <sys/stat.h>

#include <filesystem>

#include "dapple/base/error.h"
#include "dapple/image/atomic_file.h"
#include "dapple/image/image_writer.h"

namespace dapple::app {

namespace {

/// One name for all spellings of a path, and links to it, that need not exist; its folder does.
std::string plain_name(const std::string& path) {
  std::error_code ignored;
  const std::filesystem::path p(image::link_target(path));
  return (std::filesystem::weakly_canonical(p.has_parent_path() ? p.parent_path() : ".", ignored) / p.filename())
      .string();
}

}  // namespace

std::optional<OutputFiles::Identity> OutputFiles::identity(const std::string& path) {
  struct stat s {};
  if (stat(path.c_str(), &s) != 0) return std::nullopt;
  return Identity(s.st_dev, s.st_ino);
}

// As they are now: what has been written is another file than before.
std::map<OutputFiles::Identity, const OutputFiles::Output*> OutputFiles::existing() const {
  std::map<Identity, const Output*> files;
  for (const auto& [name, output] : by_name_)
    if (const auto id = identity(output.path)) files.emplace(*id, &output);
  return files;
}

void OutputFiles::add(Output output) {
  const auto refuse = [&](const Output& other) {
    throw UsageError(output.what + " and " + other.what + " would both write \"" + output.path +
                     "\"; expected a file for each");
  };
  const std::string name = plain_name(output.path);
  if (const auto named = by_name_.find(name); named != by_name_.end()) refuse(named->second);
  if (const auto id = identity(output.path)) {
    const auto files = existing();
    if (const auto same = files.find(*id); same != files.end()) refuse(*same->second);
  }
  by_name_.emplace(name, std::move(output));
}

void OutputFiles::add(const std::string& option, const std::string& path) {
  if (path.empty()) return;
  image::check_output_path(path);
  add({option, path, {}});
}

void OutputFiles::add_image(const std::string& option, const std::string& path) {
  image::check_writable(path);
  add({option, path, {}});
}

void OutputFiles::add_image_of_scene(const std::string& path, const std::string& place) {
  image::check_writable(path);
  add({"the scene's image", path, place});
}

void OutputFiles::check_input(const std::string& path) const {
  check_input(path, existing());
}

void OutputFiles::check_input(const std::string& path, const std::map<Identity, const Output*>& existing) const {
  if (existing.empty()) return;  // a file that is read exists
  const auto id = identity(path == "-" ? "/dev/stdin" : path);
  const auto found = id ? existing.find(*id) : existing.end();
  if (found == existing.end()) return;
  const Output& output = *found->second;
  const std::string message =
      output.what + " would overwrite \"" + output.path + "\", which is read; expected another file";
  if (!output.place.empty()) throw InputError(FileLoc{output.place, 0, 0}, message + ", or one given by -o");
  throw UsageError(message);
}

void OutputFiles::check_inputs(const std::vector<std::string>& paths) const {
  const auto files = existing();
  for (const std::string& path : paths) check_input(path, files);
}

}  // namespace dapple::app
