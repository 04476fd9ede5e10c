// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/base/error.h"
#include "dapple/base/rgb.h"
#include "dapple/base/vec.h"
#include "dapple/image/image.h"

namespace dapple::forest {

/// Numbers on a grid, one or three channels: values[(channel * height + y) * width + x].
struct Raster {
  int width = 0, height = 0, channels = 1;
  std::vector<float> values;

  Raster() = default;
  Raster(int w, int h, int c, float value = 0)
      : width(w), height(h), channels(c), values(size_t(w) * size_t(h) * size_t(c), value) {}
  float* row(int channel, int y) {
    return values.data() + (size_t(channel) * size_t(height) + size_t(y)) * size_t(width);
  }
  const float* row(int channel, int y) const { return const_cast<Raster*>(this)->row(channel, y); }
  float at(int channel, int x, int y) const { return row(channels == 1 ? 0 : channel, y)[x]; }
  RGB rgb(int x, int y) const { return {at(0, x, y), at(1, x, y), at(2, x, y)}; }
  double mean(int channel) const;
};

/// Transmittance (0 opaque, 1 clear) of a horizontal sheet of leaves, constant over square pixels. Column i, row j of w
/// by h pixels of side `pitch` (m) cover x in [i, i + 1) pitch - w pitch / 2 and y in h pitch / 2 - (j, j + 1] pitch: a
/// map seen from above with +x to the right and +y up, the sheet's middle at the origin. Azimuth 0 is +x, azimuth 90
/// degrees +y. Beyond its edges the sheet is clear, or repeats.
struct CanopyMask {
  Raster transmittance;
  double pitch = 1;
  bool periodic = false;

  /// Colour images (first three channels) whose channels differ make a mask in colour. width_m: of the whole mask.
  /// InputError at `loc` for numbers that are not from 0 to 1, naming the pixel, and for images without pixels;
  /// std::invalid_argument for a width that is not positive.
  static CanopyMask from_image(const image::Image& image, double width_m, bool periodic, const FileLoc& loc);

  double width_m() const { return pitch * transmittance.width; }
  double height_m() const { return pitch * transmittance.height; }
  /// At a point of the sheet; 1 outside, where the mask does not repeat.
  RGB at(double x, double y) const;
  double mean(int channel) const { return transmittance.mean(transmittance.channels == 1 ? 0 : channel); }
};

/// std::invalid_argument unless both have the same size, pixels and borders.
void check_same_grid(const CanopyMask& a, const CanopyMask& b);
/// Sheets of equal size and pixels as one: products of transmittances.
CanopyMask product(const CanopyMask& a, const CanopyMask& b);

}  // namespace dapple::forest
