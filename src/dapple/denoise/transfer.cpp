// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/transfer.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "dapple/base/parallel.h"

namespace dapple::denoise {

namespace {
constexpr double a = 1.41283765e+03, b = 1.64593172, c = .431384981, d = -2.94139609e-3, e = .192653254,
                 f = 6.26026094e-3, g = .998620152;
constexpr double y0 = 1.57945760e-6, y1 = 3.22087631e-2, x0 = 2.23151711e-3, x1 = .370974749;
double curve(double y) {
  return y <= y0 ? a * y : y <= y1 ? b * std::pow(y, c) + d : e * std::log(y + f) + g;
}
const double top = curve(65504);
}  // namespace

float to_display(float y) {
  return static_cast<float>(curve(std::min(y, 65504.f)) / top);
}

float from_display(float value) {
  const double x = std::clamp(value, 0.f, 1.f) * top;
  return static_cast<float>(x <= x0 ? x / a : x <= x1 ? std::pow((x - d) / b, 1 / c) : std::exp((x - g) / e) - f);
}

float auto_exposure(const PixelRows& colour) {
  const int w = colour.width(), h = colour.height(), nx = (w + 15) / 16, ny = (h + 15) / 16;
  // Bins as even as whole pixels allow, the larger first.
  const auto edge = [](int i, int n, int bins) { return i * (n / bins) + std::min(i, n % bins); };
  std::vector<double> means(static_cast<size_t>(nx) * ny);
  parallel_for(static_cast<size_t>(ny), [&](size_t j) {
    std::vector<float> row(static_cast<size_t>(w) * 3);
    double* const mean = &means[j * nx];
    const int ya = edge(static_cast<int>(j), h, ny), yb = edge(static_cast<int>(j) + 1, h, ny);
    for (int y = ya; y < yb; ++y) {
      colour.read(y, 0, w, row.data());
      for (int i = 0; i < nx; ++i)
        for (int x = edge(i, w, nx); x < edge(i + 1, w, nx); ++x) {
          const float* p = &row[static_cast<size_t>(x) * 3];
          mean[i] += .212671 * light(p[0]) + .715160 * light(p[1]) + .072169 * light(p[2]);
        }
    }
    for (int i = 0; i < nx; ++i) mean[i] /= static_cast<double>(edge(i + 1, w, nx) - edge(i, w, nx)) * (yb - ya);
  });
  double sum = 0;
  int count = 0;
  for (const double mean : means)
    if (mean > 1e-8) sum += std::log2(mean), ++count;
  return count ? static_cast<float>(.18 / std::exp2(sum / count)) : 1;
}

}  // namespace dapple::denoise
