// SPDX-License-Identifier: Apache-2.0
// Library: image
// Any data under any image's name are a picture of the size its header gives, or an InputError.
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "dapple/image/image.h"

namespace {

void read(const std::string& path) {
  dapple::image::ImageLimits limits;
  limits.max_bytes = uint64_t{64} << 20;  // speed; larger pictures take the same paths
  try {
    const auto info = dapple::image::read_image_info(path, {}, limits);
    const auto image = dapple::image::read_image(path, {}, {}, limits);
    if (image.width() != info.width || image.height() != info.height || image.channels() != info.channels) std::abort();
    if (image.pixels().size() != static_cast<size_t>(info.width) * info.height * info.channels) std::abort();
  } catch (const dapple::InputError&) {
  }
}

}  // namespace

// libpng leaves errors by longjmp and so passes by the destructors of OpenImageIO's PNG reader: a leak that is neither
// ours nor can be told from ours.
extern "C" const char* __asan_default_options() {
  return "detect_leaks=0";
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const int fd = memfd_create("fuzz_image", 0);
  if (fd < 0 || write(fd, data, size) != static_cast<ssize_t>(size)) std::abort();
  const std::string file = "/proc/self/fd/" + std::to_string(fd);
  // Content tells the kind, but for Targa, which goes by its name.
  read(file);
  const std::string link = "/tmp/dapple-fuzz-" + std::to_string(getpid()) + ".tga";
  unlink(link.c_str());
  if (symlink(file.c_str(), link.c_str()) == 0) {
    read(link);
    unlink(link.c_str());
  }
  close(fd);
  return 0;
}
