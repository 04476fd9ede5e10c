// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/clean_pixels.h"

#include <cmath>
#include <vector>

#include "dapple/base/parallel.h"

namespace dapple::denoise {

namespace {

constexpr int radius = 3;

// How many times the variance means of squares may be before they count as error: two standard errors of 49 squares of
// normal numbers.
constexpr double by_chance = 1.4;

/// Squares of a pixel's change and of its noise, both relative to its light.
struct Squares {
  float change = 0, noise = 0;
  bool unlit = false;  ///< no sample brought light
};

/// Mean noise around each pixel: of blocks, and those next to them.
class NoiseAround {
 public:
  NoiseAround(const std::vector<Squares>& squares, int width, int height)
      : columns_((width + side - 1) / side),
        rows_((height + side - 1) / side),
        means_(size_t(columns_) * size_t(rows_)) {
    parallel_for(means_.size(), [&](size_t b) {
      const int first_x = int(b) % columns_ * side, first_y = int(b) / columns_ * side;
      const int end_x = std::min(first_x + side, width), end_y = std::min(first_y + side, height);
      double sum = 0;
      for (int y = first_y; y < end_y; ++y)
        for (int x = first_x; x < end_x; ++x) sum += double(squares[size_t(y) * size_t(width) + size_t(x)].noise);
      means_[b] = sum / (double(end_x - first_x) * (end_y - first_y));
    });
  }
  double at(int x, int y) const {
    double sum = 0;
    int count = 0;
    for (int j = std::max(y / side - 1, 0); j <= std::min(y / side + 1, rows_ - 1); ++j)
      for (int i = std::max(x / side - 1, 0); i <= std::min(x / side + 1, columns_ - 1); ++i, ++count)
        sum += means_[size_t(j) * size_t(columns_) + size_t(i)];
    return sum / count;
  }

 private:
  static constexpr int side = 16;
  int columns_, rows_;
  std::vector<double> means_;
};

}  // namespace

void keep_clean_pixels(const PixelRows& noisy, const PixelRows& variance, image::Image* denoised) {
  const int width = denoised->width(), height = denoised->height();
  std::vector<Squares> squares(size_t(width) * size_t(height));
  parallel_for(size_t(height), [&](size_t y) {
    std::vector<float> before(3 * size_t(width)), spread(3 * size_t(width));
    noisy.read(int(y), 0, width, before.data());
    variance.read(int(y), 0, width, spread.data());
    for (int x = 0; x < width; ++x) {
      const float* after = denoised->pixel(x, int(y));
      const float scale = 1e-6f + (after[0] + after[1] + after[2]) / 3;
      Squares s;
      for (size_t c = 0; c < 3; ++c) {
        const float d = (after[c] - before[3 * size_t(x) + c]) / scale;
        s.change += d * d;
        s.noise += spread[3 * size_t(x) + c] / (scale * scale);
      }
      s.unlit = s.noise == 0 && before[3 * size_t(x)] == 0 && before[3 * size_t(x) + 1] == 0 &&
                before[3 * size_t(x) + 2] == 0;
      if (!std::isfinite(s.change) || !std::isfinite(s.noise) || s.noise < 0) s = Squares();
      squares[y * size_t(width) + size_t(x)] = s;
    }
  });
  // Where light is rare, most pixels have none of it, and no variance: of these what the image's noise is on average.
  double all = 0;
  for (const Squares& s : squares) all += double(s.noise);
  const auto noise_of_unlit = float(all / double(std::max<size_t>(squares.size(), 1)));
  for (Squares& s : squares)
    if (s.unlit) s.noise = noise_of_unlit;
  const NoiseAround around(squares, width, height);
  parallel_for(size_t(height), [&](size_t row) {
    const int y = int(row);
    std::vector<float> before(3 * size_t(width));
    noisy.read(y, 0, width, before.data());
    for (int x = 0; x < width; ++x) {
      const float* old = &before[3 * size_t(x)];
      if (!std::isfinite(old[0]) || !std::isfinite(old[1]) || !std::isfinite(old[2])) continue;
      double change = 0, largest = 0, noise = 0;
      int count = 0;
      for (int j = std::max(0, y - radius); j <= std::min(height - 1, y + radius); ++j)
        for (int i = std::max(0, x - radius); i <= std::min(width - 1, x + radius); ++i, ++count) {
          const Squares& s = squares[size_t(j) * size_t(width) + size_t(i)];
          change += double(s.change), noise += double(s.noise);
          largest = std::max(largest, double(s.change));
        }
      noise = std::max(noise, count * around.at(x, y));
      const double error = std::max(0.0, change - largest - by_chance * noise);
      if (!(error > 0)) continue;
      const auto share = float(noise / (noise + error));
      float* after = denoised->pixel(x, y);
      for (int c = 0; c < 3; ++c) after[c] = old[c] + share * (after[c] - old[c]);
    }
  });
}

}  // namespace dapple::denoise
