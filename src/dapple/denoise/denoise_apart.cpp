// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/denoise_apart.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "dapple/base/error.h"
#include "dapple/base/parallel.h"
#include "dapple/denoise/transfer.h"

namespace dapple::denoise {

namespace {

class Remainder final : public PixelRows {
 public:
  Remainder(const PixelRows& colour, const PixelRows& part)
      : PixelRows(colour.width(), colour.height()), colour_(colour), part_(part) {}
  void read(int y, int begin, int end, float* out) const override {
    colour_.read(y, begin, end, out);
    std::vector<float> part(3 * size_t(end - begin));
    part_.read(y, begin, end, part.data());
    for (size_t i = 0; i < part.size(); ++i)
      out[i] = std::isfinite(part[i]) ? std::max(out[i] - part[i], 0.0f) : out[i];
  }

 private:
  const PixelRows &colour_, &part_;
};

}  // namespace

image::Image denoise_apart(const Denoiser& denoiser, const PixelRows& colour, const PixelRows& part,
                           const PixelRows* albedo, const PixelRows* normal, Denoiser::Options options) {
  if (part.width() != colour.width() || part.height() != colour.height())
    throw UsageError("Layers to denoise must have one size");
  if (!(options.exposure > 0)) options.exposure = auto_exposure(colour);
  image::Image sum = denoiser(Remainder(colour, part), albedo, normal, options);
  const image::Image other = denoiser(part, albedo, normal, options);
  parallel_for(size_t(sum.height()), [&](size_t y) {
    const size_t row = 3 * size_t(sum.width()), begin = y * row;
    for (size_t i = begin; i < begin + row; ++i) sum.pixels()[i] += other.pixels()[i];
  });
  return sum;
}

}  // namespace dapple::denoise
