// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/mean_restoration.h"

#include <array>
#include <cmath>
#include <vector>

#include "dapple/base/parallel.h"

namespace dapple::denoise {

namespace {

constexpr double certain = 4;  // squared standard errors
constexpr double least_gain = 0.5, most_gain = 2;

using Triple = std::array<double, 3>;

/// 1 up to white, 0 from twice as bright.
float lit_share(const float* pixel, float exposure) {
  return std::clamp(2 - std::max({pixel[0], pixel[1], pixel[2]}) * exposure, 0.0f, 1.0f);
}

/// Of shares of pixels.
struct Sums {
  Triple noisy{}, denoised{};
  double variance = 0;  ///< of all channels

  void add(double share, const float* before, const float* after, const float* spread) {
    bool known = true;
    for (size_t c = 0; c < 3; ++c)
      known = known && std::isfinite(before[c]) && std::isfinite(spread[c]) && spread[c] >= 0;
    for (size_t c = 0; c < 3; ++c) {
      denoised[c] += share * double(after[c]);
      noisy[c] += share * double(known ? before[c] : after[c]);
      if (known) variance += share * share * double(spread[c]);
    }
  }
  void add(const Sums& s) {
    for (size_t c = 0; c < 3; ++c) noisy[c] += s.noisy[c], denoised[c] += s.denoised[c];
    variance += s.variance;
  }
  Triple gain() const {
    double squares = 0;
    for (size_t c = 0; c < 3; ++c) squares += (noisy[c] - denoised[c]) * (noisy[c] - denoised[c]);
    const double weight = squares > 0 ? std::max(0.0, 1 - certain * variance / squares) : 0;
    Triple gain{1, 1, 1};
    for (size_t c = 0; c < 3; ++c)
      if (denoised[c] > 0) gain[c] = std::clamp(1 + weight * (noisy[c] / denoised[c] - 1), least_gain, most_gain);
    return gain;
  }
};

}  // namespace

void restore_means(const PixelRows& noisy, const PixelRows& variance, float exposure, image::Image* denoised) {
  struct Row {
    Sums lit, shining;
  };
  const auto width = size_t(denoised->width());
  std::vector<Row> rows(size_t(denoised->height()));
  parallel_for(rows.size(), [&](size_t y) {
    std::vector<float> before(3 * width), spread(3 * width);
    noisy.read(int(y), 0, int(width), before.data());
    variance.read(int(y), 0, int(width), spread.data());
    for (size_t x = 0; x < width; ++x) {
      const float* after = denoised->pixel(int(x), int(y));
      const auto share = double(lit_share(after, exposure));
      rows[y].lit.add(share, &before[3 * x], after, &spread[3 * x]);
      if (share < 1) rows[y].shining.add(1 - share, &before[3 * x], after, &spread[3 * x]);
    }
  });
  Row all;
  for (const Row& row : rows) all.lit.add(row.lit), all.shining.add(row.shining);
  const Triple of_lit = all.lit.gain(), of_shining = all.shining.gain();
  parallel_for(rows.size(), [&](size_t y) {
    for (size_t x = 0; x < width; ++x) {
      float* pixel = denoised->pixel(int(x), int(y));
      const auto share = double(lit_share(pixel, exposure));
      for (size_t c = 0; c < 3; ++c) pixel[c] *= float(std::lerp(of_shining[c], of_lit[c], share));
    }
  });
}

}  // namespace dapple::denoise
