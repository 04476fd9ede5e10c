// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/mean_restoration.h"

#include <array>
#include <cmath>
#include <vector>

#include "dapple/base/parallel.h"

namespace dapple::denoise {

namespace {

constexpr int side = 16;       // of the smallest blocks, pixels
constexpr double certain = 4;  // squared standard errors
constexpr double least_gain = 0.5, most_gain = 2;

using Triple = std::array<double, 3>;

/// 1 up to white, 0 from twice as bright.
float lit_share(const float* pixel, float exposure) {
  return std::clamp(2 - std::max({pixel[0], pixel[1], pixel[2]}) * exposure, 0.0f, 1.0f);
}

/// Sums over a block.
struct Sums {
  Triple noisy{}, lit{}, shining{};  ///< the last two: of the denoised image, by lit_share()
  double variance = 0;               ///< of all channels
};

/// Numbers of blocks in rows, for an image of this size in pixels.
template <class T>
struct Blocks {
  int columns, rows;
  std::vector<T> values;
  Blocks(int columns_, int rows_) : columns(columns_), rows(rows_), values(size_t(columns_) * size_t(rows_)) {}
  T& at(int i, int j) { return values[size_t(j) * size_t(columns) + size_t(i)]; }
  const T& at(int i, int j) const { return values[size_t(j) * size_t(columns) + size_t(i)]; }
};

/// Where x, in blocks, lies between middles of `count` of them.
struct Between {
  int first, second;
  double share;
  Between(double x, int count) {
    const double middle = std::clamp(x - 0.5, 0.0, double(count - 1));
    first = int(middle), second = std::min(first + 1, count - 1), share = middle - first;
  }
};

Triple interpolated(const Blocks<Triple>& gains, double x, double y) {
  const Between i(x, gains.columns), j(y, gains.rows);
  Triple sum;
  for (size_t c = 0; c < 3; ++c)
    sum[c] = std::lerp(std::lerp(gains.at(i.first, j.first)[c], gains.at(i.second, j.first)[c], i.share),
                       std::lerp(gains.at(i.first, j.second)[c], gains.at(i.second, j.second)[c], i.share), j.share);
  return sum;
}

Blocks<Sums> sums_of(const PixelRows& noisy, const PixelRows& variance, float exposure, const image::Image& denoised) {
  const int width = denoised.width(), height = denoised.height();
  Blocks<Sums> blocks((width + side - 1) / side, (height + side - 1) / side);
  parallel_for(size_t(blocks.rows), [&](size_t row) {
    std::vector<float> before(3 * size_t(width)), spread(3 * size_t(width));
    for (int y = int(row) * side; y < std::min((int(row) + 1) * side, height); ++y) {
      noisy.read(y, 0, width, before.data());
      variance.read(y, 0, width, spread.data());
      for (int x = 0; x < width; ++x) {
        Sums& sums = blocks.at(x / side, int(row));
        const float *after = denoised.pixel(x, y), *was = &before[3 * size_t(x)], *v = &spread[3 * size_t(x)];
        const bool known = std::isfinite(was[0] + was[1] + was[2]) && std::isfinite(v[0] + v[1] + v[2]);
        const float share = lit_share(after, exposure);
        for (size_t c = 0; c < 3; ++c) {
          sums.lit[c] += double(share * after[c]);
          sums.shining[c] += double((1 - share) * after[c]);
          sums.noisy[c] += double(known ? was[c] : after[c]);
          if (known) sums.variance += double(v[c]);
        }
      }
    }
  });
  return blocks;
}

Triple gain_of(const Sums& sums) {
  Triple gain, denoised;
  double squares = 0;
  for (size_t c = 0; c < 3; ++c) {
    denoised[c] = sums.lit[c] + sums.shining[c];
    squares += (sums.noisy[c] - denoised[c]) * (sums.noisy[c] - denoised[c]);
  }
  const double weight = squares > 0 ? std::max(0.0, 1 - certain * sums.variance / squares) : 0;
  for (size_t c = 0; c < 3; ++c)
    gain[c] = std::clamp(1 + (denoised[c] > 0 ? weight * (sums.noisy[c] / denoised[c] - 1) : 0), least_gain, most_gain);
  return gain;
}

/// Of blocks that are `width` of these wide.
Blocks<Triple> gains_of(const Blocks<Sums>& blocks, int width) {
  Blocks<Sums> sums((blocks.columns + width - 1) / width, (blocks.rows + width - 1) / width);
  for (int j = 0; j < blocks.rows; ++j)
    for (int i = 0; i < blocks.columns; ++i) {
      Sums& sum = sums.at(i / width, j / width);
      const Sums& one = blocks.at(i, j);
      for (size_t c = 0; c < 3; ++c) {
        sum.noisy[c] += one.noisy[c];
        sum.lit[c] += one.lit[c];
        sum.shining[c] += one.shining[c];
      }
      sum.variance += one.variance;
    }
  Blocks<Triple> gains(sums.columns, sums.rows);
  for (size_t b = 0; b < sums.values.size(); ++b) gains.values[b] = gain_of(sums.values[b]);
  return gains;
}

}  // namespace

void restore_means(const PixelRows& noisy, const PixelRows& variance, float exposure, image::Image* denoised) {
  if (denoised->width() == 0 || denoised->height() == 0) return;
  Blocks<Sums> blocks = sums_of(noisy, variance, exposure, *denoised);
  Blocks<Triple> of_lit(blocks.columns, blocks.rows), of_shining(blocks.columns, blocks.rows);
  for (Blocks<Triple>* gains : {&of_lit, &of_shining})
    std::fill(gains->values.begin(), gains->values.end(), Triple{1, 1, 1});
  int width = 1;
  while (width < std::max(blocks.columns, blocks.rows)) width *= 2;
  for (; width >= 1; width /= 2) {
    const Blocks<Triple> gains = gains_of(blocks, width);
    for (int j = 0; j < blocks.rows; ++j)
      for (int i = 0; i < blocks.columns; ++i) {
        const Triple between = interpolated(gains, (i + 0.5) / width, (j + 0.5) / width);
        const Triple& own = gains.at(i / width, j / width);
        Sums& sums = blocks.at(i, j);
        for (size_t c = 0; c < 3; ++c) {
          of_lit.at(i, j)[c] *= between[c], sums.lit[c] *= between[c];
          of_shining.at(i, j)[c] *= own[c], sums.shining[c] *= own[c];
        }
      }
  }
  parallel_for(size_t(denoised->height()), [&](size_t row) {
    const int y = int(row);
    for (int x = 0; x < denoised->width(); ++x) {
      const Triple between = interpolated(of_lit, (x + 0.5) / side, (y + 0.5) / side);
      const Triple& own = of_shining.at(x / side, y / side);
      float* pixel = denoised->pixel(x, y);
      const auto share = double(lit_share(pixel, exposure));
      for (size_t c = 0; c < 3; ++c) pixel[c] *= float(std::lerp(own[c], between[c], share));
    }
  });
}

}  // namespace dapple::denoise
