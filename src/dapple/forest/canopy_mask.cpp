// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/canopy_mask.h"

#include <cmath>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "dapple/base/parallel.h"

namespace dapple::forest {

double Raster::mean(int channel) const {
  std::vector<double> lines(size_t(height), 0.0);
  parallel_for(lines.size(), [&](size_t y) {
    const float* const from = row(channel, int(y));
    lines[y] = std::accumulate(from, from + width, 0.0);
  });
  return std::accumulate(lines.begin(), lines.end(), 0.0) / (double(width) * height);
}

CanopyMask CanopyMask::from_image(const image::Image& image, double width_m, bool periodic, const FileLoc& loc) {
  if (image.width() < 1 || image.height() < 1 || image.channels() < 1)
    throw InputError(loc, "the mask has no pixels; expected at least one");
  if (!(width_m > 0 && std::isfinite(width_m))) throw std::invalid_argument("the width of a mask must be above 0 m");
  const int w = image.width(), h = image.height();
  bool coloured = false;
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      const RGB c = image.rgb(x, y);
      for (int i = 0; i < 3; ++i)
        if (!(c[i] >= 0 && c[i] <= 1))
          throw InputError(loc, "pixel " + std::to_string(x) + ", " + std::to_string(y) + " of the mask is " +
                                    std::to_string(c[i]) + ", expected a transmittance from 0 to 1");
      coloured |= c.r != c.g || c.g != c.b;
    }
  CanopyMask mask;
  mask.pitch = width_m / w;
  mask.periodic = periodic;
  mask.transmittance = Raster(w, h, coloured ? 3 : 1);
  for (int c = 0; c < mask.transmittance.channels; ++c)
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) mask.transmittance.row(c, y)[x] = image.rgb(x, y)[c];
  return mask;
}

RGB CanopyMask::at(double x, double y) const {
  const int w = transmittance.width, h = transmittance.height;
  double i = std::floor(x / pitch + 0.5 * w), j = std::floor(0.5 * h - y / pitch);
  if (periodic) {
    i -= w * std::floor(i / w);
    j -= h * std::floor(j / h);
  }
  // Also where the place is not finite.
  if (!(i >= 0 && i < w && j >= 0 && j < h)) return RGB(1);
  return transmittance.rgb(int(i), int(j));
}

void check_same_grid(const CanopyMask& a, const CanopyMask& b) {
  const Raster &p = a.transmittance, &q = b.transmittance;
  if (p.width != q.width || p.height != q.height || a.pitch != b.pitch || a.periodic != b.periodic)
    throw std::invalid_argument("masks of several sheets must have the same size, pixels and borders");
}

CanopyMask product(const CanopyMask& a, const CanopyMask& b) {
  check_same_grid(a, b);
  const Raster &p = a.transmittance, &q = b.transmittance;
  CanopyMask out = p.channels >= q.channels ? a : b;
  Raster& r = out.transmittance;
  for (int c = 0; c < r.channels; ++c)
    for (int y = 0; y < r.height; ++y)
      for (int x = 0; x < r.width; ++x) r.row(c, y)[x] = p.at(c, x, y) * q.at(c, x, y);
  return out;
}

}  // namespace dapple::forest
