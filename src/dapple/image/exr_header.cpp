// SPDX-License-Identifier: Apache-2.0
#include "dapple/image/exr_header.h"

#include <array>
#include <bit>
#include <cstring>
#include <fstream>

namespace dapple::image {

static_assert(std::endian::native == std::endian::little, "OpenEXR numbers are read as they lie in the file");

namespace {

constexpr size_t max_name = 255;  // of attributes and types, by the format
constexpr uint32_t multi_part_flag = 0x1000;
constexpr uint64_t max_channel_list = 1 << 20;  // bytes

class HeaderReader {
 public:
  HeaderReader(const std::string& path, uint64_t file_size, const ImageLimits& limits, const FileLoc& loc)
      : path_(path), file_size_(file_size), limits_(limits), loc_(loc), in_(path, std::ios::binary) {}

  void check() {
    read<uint32_t>();  // the magic number
    const bool multi_part = read<uint32_t>() & multi_part_flag;
    while (header() && multi_part) {
    }
  }

 private:
  /// One header; false if it has no attributes, which ends those of a multi-part file.
  bool header() {
    channels_ = width_ = height_ = tile_width_ = tile_height_ = 1;
    bool any = false;
    for (std::string name = text(); !name.empty(); name = text(), any = true) attribute(name, text());
    if (!any) return false;
    check_image_size(path_, width_, height_, channels_, file_size_, limits_, loc_);
    check_image_size(path_, tile_width_, tile_height_, channels_, file_size_, limits_, loc_);
    return true;
  }

  void attribute(const std::string& name, const std::string& type) {
    const int64_t size = read<int32_t>();
    const int64_t begin = in_.tellg();
    if (size < 0 || static_cast<uint64_t>(begin) + static_cast<uint64_t>(size) > file_size_)
      fail("its attribute \"" + name + "\" claims " + std::to_string(size) + " bytes");
    if (name == "dataWindow" && size == 16) {
      const auto box = read<std::array<int32_t, 4>>();
      width_ = int64_t{box[2]} - box[0] + 1;
      height_ = int64_t{box[3]} - box[1] + 1;
    } else if (name == "tiles" && size == 9) {
      const auto tile = read<std::array<uint32_t, 2>>();
      tile_width_ = tile[0];
      tile_height_ = tile[1];
    } else if (type == "chlist") {
      count_channels(static_cast<uint64_t>(size));
    }
    in_.seekg(begin + size);
  }

  void count_channels(uint64_t size) {
    if (size > max_channel_list) fail("its list of channels takes " + std::to_string(size) + " bytes");
    channels_ = 0;
    while (!text().empty()) {
      in_.seekg(16, std::ios::cur);  // type, linearity and sampling
      ++channels_;
    }
  }

  template <class T>
  T read() {
    T v;
    if (!in_.read(reinterpret_cast<char*>(&v), sizeof v)) fail("it ends within its header");
    return v;
  }

  std::string text() {
    std::string s;
    for (char c = read<char>(); c != 0; c = read<char>()) {
      if (s.size() == max_name) fail("its header holds a name without an end");
      s += c;
    }
    return s;
  }

  [[noreturn]] void fail(const std::string& why) const {
    throw InputError(loc_, "image \"" + path_ + "\" is damaged: " + why);
  }

  const std::string& path_;
  const uint64_t file_size_;
  const ImageLimits& limits_;
  const FileLoc& loc_;
  std::ifstream in_;
  int64_t channels_ = 1, width_ = 1, height_ = 1, tile_width_ = 1, tile_height_ = 1;
};

}  // namespace

void check_exr_header(const std::string& path, uint64_t file_size, const ImageLimits& limits, const FileLoc& loc) {
  HeaderReader(path, file_size, limits, loc).check();
}

void check_image_size(const std::string& path, int64_t width, int64_t height, int64_t channels, uint64_t file_size,
                      const ImageLimits& limits, const FileLoc& loc) {
  const auto refuse = [&](const std::string& why) { throw InputError(loc, "image \"" + path + "\" " + why); };
  const std::string size =
      std::to_string(width) + "x" + std::to_string(height) + " pixels of " + std::to_string(channels) + " channels";
  if (width < 1 || height < 1 || channels < 1) refuse("has no area: " + size);
  if (width > limits.max_side || height > limits.max_side || channels > limits.max_channels)
    refuse("claims " + size + ", more than the limit of " + std::to_string(limits.max_side) + " pixels a side and " +
           std::to_string(limits.max_channels) + " channels");
  const uint64_t bytes =
      sizeof(float) * static_cast<uint64_t>(width) * static_cast<uint64_t>(height) * static_cast<uint64_t>(channels);
  if (bytes > limits.max_bytes)
    refuse("claims " + size + ", which take more than the limit of " + std::to_string(limits.max_bytes >> 20) + " MiB");
  if (bytes > limits.slack_bytes && bytes / limits.max_expansion > file_size)
    refuse("claims " + size + ", too many for a file of " + std::to_string(file_size) + " bytes");
}

}  // namespace dapple::image
