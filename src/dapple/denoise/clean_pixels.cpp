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
  parallel_for(size_t(height), [&](size_t row) {
    const int y = int(row);
    std::vector<float> before(3 * size_t(width));
    noisy.read(y, 0, width, before.data());
    for (int x = 0; x < width; ++x) {
      const float* old = &before[3 * size_t(x)];
      if (!std::isfinite(old[0]) || !std::isfinite(old[1]) || !std::isfinite(old[2])) continue;
      double change = 0, noise = 0;
      for (int j = std::max(0, y - radius); j <= std::min(height - 1, y + radius); ++j)
        for (int i = std::max(0, x - radius); i <= std::min(width - 1, x + radius); ++i) {
          const Squares& s = squares[size_t(j) * size_t(width) + size_t(i)];
          change += double(s.change), noise += double(s.noise);
        }
      const double error = std::max(0.0, change - by_chance * noise);
      if (!(error > 0)) continue;
      const auto share = float(noise / (noise + error));
      float* after = denoised->pixel(x, y);
      for (int c = 0; c < 3; ++c) after[c] = old[c] + share * (after[c] - old[c]);
    }
  });
}

}  // namespace dapple::denoise
