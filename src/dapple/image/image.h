// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dapple/base/error.h"
#include "dapple/base/rgb.h"

namespace dapple::image {

/// How numbers in a file stand for linear light. Alpha is always linear.
struct Encoding {
  enum class Kind : uint8_t {
    automatic,  ///< as pbrt-v4: sRGB for 8-bit files and for PNG of any depth, linear for all others
    linear,
    srgb,  ///< IEC 61966-2-1
    gamma  ///< linear = value^gamma
  };
  Kind kind = Kind::automatic;
  float exponent = 1;  ///< of Kind::gamma

  static constexpr Encoding automatic() { return {}; }
  static constexpr Encoding linear() { return {Kind::linear, 1}; }
  static constexpr Encoding srgb() { return {Kind::srgb, 1}; }
  static constexpr Encoding gamma(float g) { return {Kind::gamma, g}; }
  /// pbrt's names: "sRGB", "linear", "gamma 2.2"; also "automatic". InputError names the legal ones.
  static Encoding parse(std::string_view name, const FileLoc& loc);

  /// Linear value of a stored one. automatic counts as linear.
  float decode(float v) const;
  friend bool operator==(const Encoding&, const Encoding&) = default;
};

float srgb_to_linear(float v);  ///< extended to negative numbers by symmetry
float linear_to_srgb(float v);  ///< inverse of srgb_to_linear

/// Pixels in memory: float, row-major, top row first, channels interleaved, linear.
class Image {
 public:
  Image() = default;
  /// All zero. Channel names default to Y; Y, A; R, G, B; R, G, B, A by their number.
  Image(int width, int height, int channels, std::vector<std::string> channel_names = {});

  int width() const { return width_; }
  int height() const { return height_; }
  int channels() const { return static_cast<int>(channel_names_.size()); }
  bool empty() const { return pixels_.empty(); }
  const std::vector<std::string>& channel_names() const { return channel_names_; }
  /// Index of the channel of this name, -1 for none.
  int channel(std::string_view name) const;
  /// Index of the alpha channel ("A" or "alpha" in any case), -1 for none.
  int alpha_channel() const;

  float* pixel(int x, int y) { return &pixels_[(static_cast<size_t>(y) * width_ + x) * channels()]; }
  const float* pixel(int x, int y) const { return &pixels_[(static_cast<size_t>(y) * width_ + x) * channels()]; }
  /// Colour of a pixel: R, G, B by name, else the first three channels, else the first one as grey.
  RGB rgb(int x, int y) const;
  std::span<float> pixels() { return pixels_; }
  std::span<const float> pixels() const { return pixels_; }

  /// A copy with only these channels.
  Image select(std::span<const int> channels) const;

 private:
  int width_ = 0, height_ = 0;
  std::vector<std::string> channel_names_;
  std::vector<float> pixels_;
};

/// What a file says about itself before its pixels are read.
struct ImageInfo {
  std::string format;  ///< OpenImageIO's name of the reader, such as "openexr"
  int width = 0, height = 0, channels = 0;
  int bits = 0;  ///< of a stored sample
  bool floating_point = false;
  bool tiled_mipmap = false;  ///< fit for look-ups as it is
  Encoding encoding;          ///< what Encoding::automatic means for this file: srgb or linear
  std::vector<std::string> channel_names;

  bool has_alpha() const;
  /// Colours are multiplied by alpha in the file, as OpenEXR means it.
  bool associated_alpha() const { return format == "openexr" && has_alpha(); }
};

/// Bounds on what a file may ask for; beyond them reading throws InputError before memory is taken.
struct ImageLimits {
  int max_side = 65536;
  int max_channels = 64;
  uint64_t max_bytes = uint64_t{4} << 30;  ///< decoded to float
  /// Decoded size over file size: no reader's compression beats this but for blank images, which `slack_bytes` lets
  /// through.
  uint64_t max_expansion = 1100;
  uint64_t slack_bytes = uint64_t{256} << 20;
};

/// Reads the first image of a file: EXR, PNG, JPEG, TGA, Radiance HDR, PFM and PNM, TIFF, BMP, WebP. The kind is
/// told from the content (TGA, which has no mark, from the name), never by trying every reader. Colour is decoded to
/// linear; alpha, where there is one, is not multiplied in. Throws InputError for whatever cannot be read whole:
/// missing, a folder or device, unknown, damaged, deep, beyond the limits.
Image read_image(const std::string& path, const FileLoc& loc, Encoding encoding = Encoding::automatic(),
                 const ImageLimits& limits = {});
/// The header alone; same errors.
ImageInfo read_image_info(const std::string& path, const FileLoc& loc, const ImageLimits& limits = {});

}  // namespace dapple::image
