// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dapple/base/error.h"
#include "dapple/base/vec.h"
#include "dapple/image/image.h"

namespace dapple::image {

/// A whole OpenEXR file in memory as it is stored: all parts and channels, halfs as halfs, and its attributes as far as
/// OpenImageIO knows them. So some channels can be replaced while the others are written bit for bit as they were read.
class ExrFile {
 public:
  struct Channel {
    std::string name;
    bool is_number = true;  ///< half or float; else 32-bit integer
    bool is_half = false;
    size_t offset = 0;  ///< in bytes, within a pixel
  };
  struct Part {
    std::string name;  ///< empty in files of one part, mostly
    int width = 0, height = 0;
    int x = 0, y = 0;                                                         ///< corner of the data window
    int display_width = 0, display_height = 0, display_x = 0, display_y = 0;  ///< display window
    std::vector<Channel> channels;
    size_t pixel_bytes = 0;
    std::vector<std::byte> pixels;
  };

  /// InputError for what is no OpenEXR file, damaged, or cannot be kept whole: deep, or with MIP levels; IoError where
  /// it cannot be opened.
  explicit ExrFile(const std::string& path);
  ~ExrFile();

  const std::vector<Part>& parts() const { return parts_; }
  /// Numbers of pixels [begin, end) of a row, three each, of half or float channels.
  void read(size_t part, const std::array<size_t, 3>& channels, int y, int begin, int end, float* out) const;
  /// `image`, of the part's size with three channels, takes their place, in the type that they have; halfs are kept
  /// within their range.
  void replace(size_t part, const std::array<size_t, 3>& channels, const Image& image);
  /// An attribute of the first part; none where there is no such one of this type.
  std::optional<M44f> matrix(const std::string& attribute) const;
  std::optional<float> number(const std::string& attribute) const;  ///< float or int
  std::optional<std::string> text(const std::string& attribute) const;
  /// In the header of all parts.
  void set_text(const std::string& attribute, const std::string& text);

  /// Writes all: IoError where that fails. Where the file was compressed with loss by B44 or DWA, which would change
  /// other channels once more, it is by ZIP. Where some parts have tiles and others have not, all become scan lines,
  /// since OpenImageIO 2.4 writes no such files.
  void write(const std::string& path) const;

 private:
  struct Headers;
  std::vector<Part> parts_;
  std::unique_ptr<Headers> headers_;
};

}  // namespace dapple::image
