// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/transfer.h"

#include <algorithm>
#include <cmath>

namespace dapple::denoise {

namespace {
constexpr double a = 1.41283765e+03, b = 1.64593172, c = .431384981, d = -2.94139609e-3, e = .192653254, f = 6.26026094e-3,
                 g = .998620152;
constexpr double y0 = 1.57945760e-6, y1 = 3.22087631e-2, x0 = 2.23151711e-3, x1 = .370974749;
double curve(double y) { return y <= y0 ? a * y : y <= y1 ? b * std::pow(y, c) + d : e * std::log(y + f) + g; }
const double top = curve(65504);
}  // namespace

float to_display(float y) { return static_cast<float>(curve(std::min(y, 65504.f)) / top); }

float from_display(float value) {
  const double x = std::clamp(value, 0.f, 1.f) * top;
  return static_cast<float>(x <= x0 ? x / a : x <= x1 ? std::pow((x - d) / b, 1 / c) : std::exp((x - g) / e) - f);
}

float auto_exposure(const image::Image& colour) {
  const int w = colour.width(), h = colour.height(), nx = (w + 15) / 16, ny = (h + 15) / 16;
  // Bins as even as whole pixels allow, the larger first.
  const auto edge = [](int i, int n, int bins) { return i * (n / bins) + std::min(i, n % bins); };
  double sum = 0;
  int count = 0;
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      double mean = 0;
      const int xa = edge(i, w, nx), xb = edge(i + 1, w, nx), ya = edge(j, h, ny), yb = edge(j + 1, h, ny);
      for (int y = ya; y < yb; ++y)
        for (int x = xa; x < xb; ++x) {
          const float* p = colour.pixel(x, y);
          mean += .212671 * p[0] + .715160 * p[1] + .072169 * p[2];
        }
      mean /= static_cast<double>(xb - xa) * (yb - ya);
      if (mean > 1e-8) sum += std::log2(mean), ++count;
    }
  return count ? static_cast<float>(.18 / std::exp2(sum / count)) : 1;
}

}  // namespace dapple::denoise
