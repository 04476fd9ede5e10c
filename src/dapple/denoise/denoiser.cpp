// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/denoiser.h"

#include <algorithm>
#include <cmath>

#include "dapple/base/error.h"
#include "dapple/base/parallel.h"
#include "dapple/denoise/transfer.h"

namespace dapple::denoise {

namespace {

constexpr int overlap = 96;  // the network sees 87 pixels each way; a multiple of 16

float finite(float v) { return std::isfinite(v) ? v : 0; }

struct Frame {
  const image::Image& colour;
  const image::Image* albedo;
  const image::Image* normal;
  float exposure;

  void encode(int x, int y, float* to) const {
    for (int c = 0; c < 3; ++c) to[c] = to_display(colour.pixel(x, y)[c] * exposure);
    if (albedo)
      for (int c = 0; c < 3; ++c) to[3 + c] = std::clamp(finite(albedo->pixel(x, y)[c]), 0.f, 1.f);
    if (normal)
      for (int c = 0; c < 3; ++c) to[6 + c] = .5f * std::clamp(finite(normal->pixel(x, y)[c]), -1.f, 1.f) + .5f;
  }
};

struct Range {
  int begin, end;
};

/// A tile of `range` with what the network sees around it.
void denoise_tile(const UNet& net, const Frame& frame, Range xs, Range ys, const StopToken& stop, image::Image& out) {
  const int x0 = std::max(0, xs.begin - overlap), x1 = std::min(out.width(), xs.end + overlap);
  const int y0 = std::max(0, ys.begin - overlap), y1 = std::min(out.height(), ys.end + overlap);
  const int w = (x1 - x0 + 15) / 16 * 16, h = (y1 - y0 + 15) / 16 * 16, n = net.inputs();
  std::vector<float> in(static_cast<size_t>(w) * h * n), result(static_cast<size_t>(w) * h * 3);
  parallel_for(y1 - y0, [&](size_t y) {
    for (int x = x0; x < x1; ++x) frame.encode(x, y0 + static_cast<int>(y), &in[(y * w + x - x0) * n]);
  });
  net.run(in, w, h, result, stop);
  parallel_for(ys.end - ys.begin, [&](size_t i) {
    const int y = ys.begin + static_cast<int>(i);
    for (int x = xs.begin; x < xs.end; ++x)
      for (int c = 0; c < 3; ++c)
        out.pixel(x, y)[c] = from_display(result[(static_cast<size_t>(y - y0) * w + x - x0) * 3 + c]) / frame.exposure;
  });
}

}  // namespace

Denoiser::Denoiser(const std::string& weights) : net_(read_tensors(weights), weights) {
  if ((inputs() != 3 && inputs() != 6 && inputs() != 9) || net_.outputs() != 3)
    throw InputError(FileLoc{weights}, "not a network for denoising: it takes " + std::to_string(inputs()) + " channels, not 3, 6 or 9");
}

image::Image Denoiser::operator()(const image::Image& colour, const image::Image* albedo, const image::Image* normal,
                                  const Options& options) const {
  const int tile = options.tile;
  if (inputs() < 6) albedo = nullptr;
  if (inputs() < 9) normal = nullptr;
  if ((inputs() >= 6 && !albedo) || (inputs() == 9 && !normal)) throw UsageError("The network needs albedo or normals, which are not there");
  for (const image::Image* layer : {&colour, albedo, normal})
    if (layer && (layer->width() != colour.width() || layer->height() != colour.height() || layer->channels() != 3))
      throw UsageError("Layers to denoise must have three channels and one size");
  if (tile < 16 || tile % 16) throw UsageError("The side of a tile must be a multiple of 16");

  const int w = colour.width(), h = colour.height();
  image::Image clean = colour;
  for (float& v : clean.pixels()) v = std::max(0.f, finite(v));
  const Frame frame{clean, albedo, normal, auto_exposure(clean)};
  image::Image out(w, h, 3, {"R", "G", "B"});
  for (int y = 0; y < h; y += tile)
    for (int x = 0; x < w; x += tile) denoise_tile(net_, frame, {x, std::min(w, x + tile)}, {y, std::min(h, y + tile)}, options.stop, out);
  return out;
}

}  // namespace dapple::denoise
