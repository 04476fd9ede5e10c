// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/error_estimate.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "dapple/base/parallel.h"
#include "dapple/base/vec.h"

namespace dapple::denoise {

using image::Image;

namespace {

// Of squares that are summed twice, so that weights fall off and no square shows.
constexpr int near_radius = 2, wide_radius = 5;

// By which crossed squares are divided: halves err by 1.27 to 1.48 times the whole's squares in rooms of 8 to 128
// samples, and halves of stratified samples differ by more than their noise, which makes crossed squares too small. So
// measured that estimates are right in the mean of four scenes.
constexpr float half_loss = 1.1f;

// What a pixel's relative squares, of three channels, count for at most: one lamp that the network takes for a firefly
// would else decide for the whole picture.
constexpr float most_square = 30;

// Of what the whole picture's ratio tells, what crossed squares must leave: their mean may be below 0 by chance.
constexpr double least_share = 0.25;

template <class Work>
void for_rows(int height, bool loops, const Work& work) {
  if (loops) return parallel_for(size_t(height), work);
  for (size_t y = 0; y < size_t(height); ++y) work(y);
}

/// Sums over squares of 2 r + 1 pixels within the picture, along x and then along y: without differences of large sums,
/// of which small ones would be lost beside fireflies.
Image square_sums(const Image& image, int r, bool loops = true) {
  const int width = image.width(), height = image.height(), channels = image.channels();
  Image along(width, height, channels), sums(width, height, channels);
  for_rows(height, loops, [&](size_t row) {
    const int y = int(row);
    for (int x = 0; x < width; ++x)
      for (int i = std::max(0, x - r); i <= std::min(width - 1, x + r); ++i)
        for (int c = 0; c < channels; ++c) along.pixel(x, y)[c] += image.pixel(i, y)[c];
  });
  for_rows(height, loops, [&](size_t row) {
    const int y = int(row);
    for (int j = std::max(0, y - r); j <= std::min(height - 1, y + r); ++j)
      for (int x = 0; x < width; ++x)
        for (int c = 0; c < channels; ++c) sums.pixel(x, y)[c] += along.pixel(x, j)[c];
  });
  return sums;
}

Image tent_sums(const Image& image, int r) {
  return square_sums(square_sums(image, r), r);
}

// What is measured of each pixel relative to its light, summed over channels: crossed squares, their squares, and the
// square of the difference of the denoised halves; and 1.
enum Measure { crossed, crossed_square, difference, number, measures_of_pixel };

/// What light a pixel's errors are relative to: its own, but no less than a part of what the picture shows.
class Light {
 public:
  explicit Light(const Image& picture) : picture_(picture) {
    std::vector<float> lit;
    for (int y = 0; y < picture.height(); ++y)
      for (int x = 0; x < picture.width(); ++x)
        if (const float l = mean(x, y); l > 0) lit.push_back(l);
    if (lit.empty()) return;
    const auto middle = lit.begin() + std::ptrdiff_t(lit.size() / 2);
    std::nth_element(lit.begin(), middle, lit.end());
    least_ = dark_share * *middle;
  }
  float operator()(int x, int y) const { return std::max(mean(x, y), 0.0f) + least_; }

 private:
  static constexpr float dark_share = 0.1f;
  float mean(int x, int y) const {
    const float* p = picture_.pixel(x, y);
    return (p[0] + p[1] + p[2]) / 3;
  }
  const Image& picture_;
  float least_ = 1e-6f;
};

Image measure(const Halves& h, const Light& light) {
  const int width = h.denoised.width(), height = h.denoised.height();
  Image measures(width, height, measures_of_pixel);
  parallel_for(size_t(height), [&](size_t row) {
    const int y = int(row);
    std::vector<float> a(3 * size_t(width)), b(3 * size_t(width));
    h.first.read(y, 0, width, a.data());
    h.second.read(y, 0, width, b.data());
    for (int x = 0; x < width; ++x) {
      const float *A = h.denoised_first.pixel(x, y), *B = h.denoised_second.pixel(x, y);
      float cross = 0, apart = 0;
      for (int c = 0; c < 3; ++c) {
        const float first = a[3 * size_t(x) + size_t(c)], second = b[3 * size_t(x) + size_t(c)];
        const float ab = A[c] - second, ba = B[c] - first, noise = first - second, d = A[c] - B[c];
        cross += (ab * ab + ba * ba - noise * noise) / (2 * half_loss);
        apart += d * d / 4;
      }
      const float scale = 1 / (light(x, y) * light(x, y));
      cross *= scale, apart *= scale;
      float* m = measures.pixel(x, y);
      m[number] = 1;
      if (!std::isfinite(cross) || !std::isfinite(apart)) continue;
      cross = std::clamp(cross, -most_square, most_square), apart = std::min(apart, most_square);
      m[crossed] = cross, m[crossed_square] = cross * cross, m[difference] = apart;
    }
  });
  return measures;
}

/// Ratio of crossed squares to those of differences over the whole picture; halves never differ by more than they err.
double whole_ratio(const Image& measures) {
  double sums[2] = {0, 0};
  for (int y = 0; y < measures.height(); ++y)
    for (int x = 0; x < measures.width(); ++x) {
      const float* m = measures.pixel(x, y);
      sums[0] += double(m[crossed]), sums[1] += double(m[difference]);
    }
  return sums[1] > 0 ? std::max(1.0, sums[0] / sums[1]) : 1;
}

/// As many pixels of equal weight have a mean as exact as that of tent sums, of which `sum` is that of the weights.
double independent(float sum) {
  constexpr double side = 2 * wide_radius + 1;
  return 2.25 * double(sum) / (side * side);
}

}  // namespace

Image smooth_variance(const PixelRows& variance, bool loops) {
  const int width = variance.width(), height = variance.height();
  Image known(width, height, 2);  // means over channels, and how many
  for_rows(height, loops, [&](size_t y) {
    std::vector<float> row(3 * size_t(width));
    variance.read(int(y), 0, width, row.data());
    for (int x = 0; x < width; ++x) {
      const float mean = (row[3 * size_t(x)] + row[3 * size_t(x) + 1] + row[3 * size_t(x) + 2]) / 3;
      if (std::isfinite(mean)) known.pixel(x, int(y))[0] = mean, known.pixel(x, int(y))[1] = 1;
    }
  });
  const Image around = square_sums(known, smooth_radius, loops);
  Image smooth(width, height, 1);
  for_rows(height, loops, [&](size_t y) {
    for (int x = 0; x < width; ++x) {
      const float* sums = around.pixel(x, int(y));
      smooth.pixel(x, int(y))[0] = known.pixel(x, int(y))[1] > 0 ? sums[0] / sums[1] : infinity;
    }
  });
  return smooth;
}

Image relative_error(const Halves& h) {
  const Light light(h.denoised);
  const Image measures = measure(h, light);
  const double ratio = whole_ratio(measures);
  const Image around = tent_sums(measures, wide_radius), near = tent_sums(measures, near_radius);
  Image errors(h.denoised.width(), h.denoised.height(), 1);
  parallel_for(size_t(errors.height()), [&](size_t row) {
    const int y = int(row);
    for (int x = 0; x < errors.width(); ++x) {
      const float *s = around.pixel(x, y), *close = near.pixel(x, y);
      const double mean = double(s[crossed] / s[number]), expected = ratio * double(s[difference] / s[number]);
      const double spread = double(s[crossed_square] / s[number]) - mean * mean;
      const double noise = std::max(0.0, spread) / independent(s[number]);  // variance of the mean
      const double most = std::max(expected, mean);
      if (!(most > 0)) continue;
      const double trust = most * most / (most * most + noise);
      const double square = std::max(trust * mean + (1 - trust) * expected, least_share * expected);
      const double here = double(close[difference] / close[number]);
      const double told = square / 3 * (expected > 0 ? here * ratio / expected : 1);
      errors.pixel(x, y)[0] = float(std::min(told, double(most_square / 3)));
    }
  });
  return errors;
}

void multiply_by_light(const Image& denoised, Image* squares) {
  const Light light(denoised);
  for (int y = 0; y < squares->height(); ++y)
    for (int x = 0; x < squares->width(); ++x) squares->pixel(x, y)[0] *= light(x, y) * light(x, y);
}

}  // namespace dapple::denoise
