// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/weights.h"

#include <dlfcn.h>

#include <cstdlib>
#include <filesystem>

#include "dapple/base/error.h"

namespace dapple::denoise {

namespace fs = std::filesystem;

namespace {

/// The program, or the shared library, that holds this code.
fs::path own_file() {
  Dl_info info{};
  std::error_code error;
  // Programs are known to dladdr by the name that they were called by, which need not be a path.
  const bool library = dladdr(reinterpret_cast<const void*>(&find_weights), &info) && info.dli_fname &&
                       std::string_view(info.dli_fname).ends_with(".so");
  return fs::canonical(library ? info.dli_fname : "/proc/self/exe", error);
}

}  // namespace

std::string find_weights(std::string_view name, const std::string& installed) {
  std::error_code error;
  const auto is_file = [&](const fs::path& path) { return fs::is_regular_file(path, error); };
  if (const char* folder = std::getenv("DAPPLE_WEIGHTS"); folder && *folder) {
    const fs::path path = fs::path(folder) / name;
    return is_file(path) ? path.string() : std::string();
  }
  if (const fs::path path = fs::path(installed) / name; !installed.empty() && is_file(path)) return path.string();
  for (fs::path folder = own_file().parent_path(); !folder.empty(); folder = folder.parent_path()) {
    const fs::path path = folder / "share/dapple/denoise" / name;
    if (is_file(path)) return path.string();
    if (folder == folder.root_path()) break;
  }
  return {};
}

std::string weights_path(std::string_view name, const std::string& installed) {
  const std::string path = find_weights(name, installed);
  if (path.empty())
    throw IoError("the denoiser's weights, \"" + std::string(name) +
                  "\", are missing; expected them in $DAPPLE_WEIGHTS, or in share/dapple/denoise above the program");
  return path;
}

}  // namespace dapple::denoise
