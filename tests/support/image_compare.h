// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace dapple::test {

/// A linear RGB picture, top row first. Read and written with OpenImageIO directly, apart from Dapple's own image
/// library, so that a fault there cannot hide itself.
struct Picture {
  int width = 0, height = 0;
  std::vector<float> rgb;  ///< 3 * width * height

  Picture() = default;
  Picture(int w, int h) : width(w), height(h), rgb(3 * static_cast<size_t>(w) * h) {}
  float* at(int x, int y) { return &rgb[3 * (static_cast<size_t>(y) * width + x)]; }
  const float* at(int x, int y) const { return &rgb[3 * (static_cast<size_t>(y) * width + x)]; }
  float luminance(int x, int y) const;
};

/// The channels R, G, B (or the first three, or one as grey) of the first image of a file, values as stored.
/// std::runtime_error says what is wrong with the file.
Picture load_picture(const std::string& path);
Picture crop(const Picture& p, int x0, int y0, int x1, int y1);  ///< x1, y1 exclusive
Picture flip_horizontally(const Picture& p);
/// Box-filters by a whole factor, which must divide both sides.
Picture shrink(const Picture& p, int factor);

/// Which pixels a comparison counts: 1 = counts, 0 = left out.
class Mask {
 public:
  Mask() = default;
  Mask(int width, int height) : width_(width), height_(height), counts_(static_cast<size_t>(width) * height, 1) {}

  int width() const { return width_; }
  int height() const { return height_; }
  bool counts(int x, int y) const { return counts_[static_cast<size_t>(y) * width_ + x] != 0; }
  void leave_out(int x, int y) { counts_[static_cast<size_t>(y) * width_ + x] = 0; }
  size_t count() const;

  /// Leaves out the brightest `fraction` of the pixels, by luminance.
  void leave_out_brightest(const Picture& p, double fraction);
  /// Leaves out pixels brighter than `times` the median luminance.
  void leave_out_above_median(const Picture& p, double times);
  /// Leaves out also all pixels within `radius` (Chebyshev distance) of one left out.
  void dilate(int radius);

 private:
  int width_ = 0, height_ = 0;
  std::vector<uint8_t> counts_;
};

/// How far a picture is from its reference, over the pixels that count. "Relative" is always to the reference's mean:
/// of the channel for numbers per channel, of all three for the others.
struct Comparison {
  size_t pixels = 0;
  std::array<double, 3> mean{}, reference_mean{};
  std::array<double, 3> mean_error{};  ///< signed, relative
  double relative_rmse = 0;            ///< of pixels

  int block = 0;                         ///< side of a block in pixels
  size_t blocks = 0;                     ///< those with at least half of their pixels counting
  double block_rmse = 0, block_max = 0;  ///< of block averages, relative
  std::array<double, 3> block_rmse_channel{};
  int worst_x = 0, worst_y = 0;  ///< top left pixel of the worst block

  double max_mean_error() const;
  std::string to_text() const;
  std::string to_json() const;
};

/// std::invalid_argument where the sizes differ or no pixel counts; a number that is not finite counts as an infinite
/// error.
Comparison compare(const Picture& p, const Picture& reference, const Mask& mask, int block);

/// p - reference relative to the reference's mean as a PNG: blue where p is darker, white where equal, red where
/// brighter, saturated at +-`range`; pixels left out are grey.
void write_difference(const std::string& path, const Picture& p, const Picture& reference, const Mask& mask,
                      double range);

}  // namespace dapple::test
