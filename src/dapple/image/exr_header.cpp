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

/// Types of one size. OpenEXR reads that many bytes whatever an attribute claims, so another size would have it take
/// the rest for something else.
struct FixedType {
  std::string_view name;
  int64_t size;
};
constexpr FixedType fixed_types[] = {{"box2f", 16},
                                     {"box2i", 16},
                                     {"chromaticities", 32},
                                     {"compression", 1},
                                     {"deepImageState", 1},
                                     {"double", 8},
                                     {"envmap", 1},
                                     {"float", 4},
                                     {"int", 4},
                                     {"keycode", 28},
                                     {"lineOrder", 1},
                                     {"m33d", 72},
                                     {"m33f", 36},
                                     {"m44d", 128},
                                     {"m44f", 64},
                                     {"rational", 8},
                                     {"tiledesc", 9},
                                     {"timecode", 8},
                                     {"v2d", 16},
                                     {"v2f", 8},
                                     {"v2i", 8},
                                     {"v3d", 24},
                                     {"v3f", 12},
                                     {"v3i", 12}};

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
    for (const FixedType& fixed : fixed_types)
      if (type == fixed.name && size != fixed.size)
        fail("its attribute \"" + name + "\" of type " + type + " has " + std::to_string(size) + " bytes");
    if (name == "dataWindow" && type == "box2i") {
      const auto box = read<std::array<int32_t, 4>>();
      width_ = int64_t{box[2]} - box[0] + 1;
      height_ = int64_t{box[3]} - box[1] + 1;
    } else if (name == "tiles" && type == "tiledesc") {
      const auto tile = read<std::array<uint32_t, 2>>();
      tile_width_ = tile[0];
      tile_height_ = tile[1];
    } else if (type == "chlist") {
      channels_ = count_channels();
      if (in_.tellg() != begin + size) fail("its list of channels has another length than it claims");
    } else if (type == "stringvector") {
      check_strings(size);
    } else if (type == "preview") {
      const auto side = read<std::array<uint32_t, 2>>();
      if (uint64_t{side[0]} * side[1] * 4 + 8 != static_cast<uint64_t>(size))
        fail("its preview has another size than it claims");
    }
    in_.seekg(begin + size);
  }

  int64_t count_channels() {
    int64_t channels = 0;
    while (!text().empty()) {
      read<std::array<char, 16>>();  // type, linearity and sampling
      ++channels;
    }
    return channels;
  }

  void check_strings(int64_t size) {
    while (size > 0) {
      const int64_t length = read<int32_t>();
      size -= length + int64_t{sizeof(int32_t)};
      if (length < 0 || size < 0) fail("a list of texts has another length than it claims");
      in_.seekg(length, std::ios::cur);
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
