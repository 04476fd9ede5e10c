// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "dapple/image/image.h"

namespace dapple::denoise {

/// A picture of three channels, wherever it lies, read by rows. Threads read at the same time.
class PixelRows {
 public:
  PixelRows(int width, int height) : width_(width), height_(height) {}
  virtual ~PixelRows() = default;
  int width() const { return width_; }
  int height() const { return height_; }
  /// Numbers of pixels [begin, end) of row y, three each.
  virtual void read(int y, int begin, int end, float* out) const = 0;

 private:
  int width_, height_;
};

/// Of an image with three channels, which must outlive this.
class ImageRows final : public PixelRows {
 public:
  explicit ImageRows(const image::Image& image) : PixelRows(image.width(), image.height()), image_(image) {}
  void read(int y, int begin, int end, float* out) const override {
    std::copy_n(image_.pixel(begin, y), 3 * (end - begin), out);
  }

 private:
  const image::Image& image_;
};

}  // namespace dapple::denoise
