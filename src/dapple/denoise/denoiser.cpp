// SPDX-License-Identifier: Apache-2.0
#include "dapple/denoise/denoiser.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>

#include "dapple/base/error.h"
#include "dapple/base/parallel.h"
#include "dapple/denoise/transfer.h"

namespace dapple::denoise {

namespace {

constexpr int overlap = 96;  // the network sees 87 pixels each way; a multiple of 16

constexpr int64_t most_pixels = 2'100'000;  // that enter the network at a time, some 240 bytes each

float finite(float v) {
  return std::isfinite(v) ? v : 0;
}
int up16(int n) {
  return (n + 15) / 16 * 16;
}

struct Frame {
  const PixelRows& colour;
  const PixelRows* albedo;
  const PixelRows* normal;
  float exposure;
  int channels;

  /// Pixels [begin, end) of a row, `channels` each.
  void encode(int y, int begin, int end, float* to) const {
    std::vector<float> row(static_cast<size_t>(end - begin) * 3);
    const auto put = [&](const PixelRows& layer, int first, const auto& transfer) {
      layer.read(y, begin, end, row.data());
      for (int i = 0; i < end - begin; ++i)
        for (int c = 0; c < 3; ++c) to[i * channels + first + c] = transfer(row[static_cast<size_t>(i) * 3 + c]);
    };
    put(colour, 0, [&](float v) { return to_display(light(v) * exposure); });
    if (albedo) put(*albedo, 3, [](float v) { return std::clamp(finite(v), 0.f, 1.f); });
    if (normal) put(*normal, 6, [](float v) { return .5f * std::clamp(finite(v), -1.f, 1.f) + .5f; });
  }
};

struct Range {
  int begin, end;
  int size() const { return end - begin; }
};

/// With what the network sees around it.
Range widened(Range r, int size) {
  return {std::max(0, r.begin - overlap), std::min(size, r.end + overlap)};
}

/// Sides of tiles without overlap.
struct Tiles {
  int width, height;
};

/// Those through which the fewest pixels enter the network, overlaps included. A function of the size alone: a picture
/// is the same from memory and from a file.
Tiles choose_tiles(int width, int height) {
  if (int64_t{up16(width)} * up16(height) <= most_pixels) return {up16(width), up16(height)};
  Tiles best{16, 16};
  int64_t least = std::numeric_limits<int64_t>::max();
  const auto side = [](int size, int count) { return up16((size + count - 1) / count); };
  const auto total = [](int size, int tile) {
    int64_t sum = 0;
    for (int i = 0; i < size; i += tile) sum += up16(widened({i, std::min(size, i + tile)}, size).size());
    return sum;
  };
  const auto largest = [](int size, int tile) { return int64_t{std::min(up16(size), tile + 2 * overlap)}; };
  for (int nx = 1; nx <= (width + 15) / 16; ++nx)
    for (int ny = 1; ny <= (height + 15) / 16; ++ny) {
      const Tiles t{side(width, nx), side(height, ny)};
      if (largest(width, t.width) * largest(height, t.height) > most_pixels) continue;
      const int64_t pixels = total(width, t.width) * total(height, t.height);
      if (pixels < least) least = pixels, best = t;
      break;  // more rows cost more
    }
  return best;
}

/// No light at all: the network, which adds to what it gets, is not asked.
bool is_black(const PixelRows& colour) {
  std::atomic<bool> lit{false};
  parallel_for(static_cast<size_t>(colour.height()), [&](size_t y) {
    if (lit) return;
    std::vector<float> row(static_cast<size_t>(colour.width()) * 3);
    colour.read(static_cast<int>(y), 0, colour.width(), row.data());
    if (std::any_of(row.begin(), row.end(), [](float v) { return light(v) > 0; })) lit = true;
  });
  return !lit;
}

void denoise_tile(const UNet& net, const Frame& frame, Range xs, Range ys, const StopToken& stop, image::Image& out) {
  const Range wide = widened(xs, out.width()), high = widened(ys, out.height());
  const int w = up16(wide.size()), h = up16(high.size()), n = net.inputs();
  std::vector<float> result(static_cast<size_t>(w) * h * 3);
  {
    std::vector<float> in(static_cast<size_t>(w) * h * n);
    parallel_for(high.size(), [&](size_t y) {
      frame.encode(high.begin + static_cast<int>(y), wide.begin, wide.end, &in[y * w * n]);
    });
    net.run(in, w, h, result, stop);
  }
  parallel_for(ys.size(), [&](size_t i) {
    const int y = ys.begin + static_cast<int>(i);
    for (int x = xs.begin; x < xs.end; ++x)
      for (int c = 0; c < 3; ++c)
        out.pixel(x, y)[c] =
            from_display(result[(static_cast<size_t>(y - high.begin) * w + x - wide.begin) * 3 + c]) / frame.exposure;
  });
}

}  // namespace

Denoiser::Denoiser(const std::string& weights)
    : weights_(std::filesystem::path(weights).filename().string()), net_(read_tensors(weights), weights) {
  if ((inputs() != 3 && inputs() != 6 && inputs() != 9) || net_.outputs() != 3)
    throw InputError(FileLoc{weights},
                     "not a network for denoising: it takes " + std::to_string(inputs()) + " channels, not 3, 6 or 9");
}

std::string Denoiser::description() const {
  return weights_ + ", " + instruction_set();
}

image::Image Denoiser::operator()(const PixelRows& colour, const PixelRows* albedo, const PixelRows* normal,
                                  const Options& options) const {
  if (inputs() < 6) albedo = nullptr;
  if (inputs() < 9) normal = nullptr;
  if ((inputs() >= 6 && !albedo) || (inputs() == 9 && !normal))
    throw UsageError("The network needs albedo or normals, which are not there");
  for (const PixelRows* layer : {&colour, albedo, normal})
    if (layer && (layer->width() != colour.width() || layer->height() != colour.height()))
      throw UsageError("Layers to denoise must have one size");
  if (options.tile < 0 || options.tile % 16) throw UsageError("The side of a tile must be a multiple of 16");

  const int w = colour.width(), h = colour.height();
  const Tiles tiles = options.tile > 0 ? Tiles{options.tile, options.tile} : choose_tiles(w, h);
  const float exposure = options.exposure > 0 ? options.exposure : auto_exposure(colour);
  const Frame frame{colour, albedo, normal, exposure, inputs()};
  image::Image out(w, h, 3, {"R", "G", "B"});
  if (is_black(colour)) return out;
  for (int y = 0; y < h; y += tiles.height)
    for (int x = 0; x < w; x += tiles.width)
      denoise_tile(net_, frame, {x, std::min(w, x + tiles.width)}, {y, std::min(h, y + tiles.height)}, options.stop,
                   out);
  return out;
}

image::Image Denoiser::operator()(const image::Image& colour, const image::Image* albedo, const image::Image* normal,
                                  const Options& options) const {
  for (const image::Image* layer : {&colour, albedo, normal})
    if (layer && layer->channels() != 3) throw UsageError("Layers to denoise must have three channels");
  const ImageRows rows(colour);
  std::optional<ImageRows> albedo_rows, normal_rows;
  if (albedo) albedo_rows.emplace(*albedo);
  if (normal) normal_rows.emplace(*normal);
  return (*this)(rows, albedo ? &*albedo_rows : nullptr, normal ? &*normal_rows : nullptr, options);
}

void add_up_to(const image::Image& whole, std::span<image::Image> parts) {
  if (parts.empty()) return;
  parallel_for(static_cast<size_t>(whole.height()), [&](size_t y) {
    const size_t row = static_cast<size_t>(whole.width()) * 3, begin = y * row;
    for (size_t i = begin; i < begin + row; ++i) {
      double sum = 0;
      for (const image::Image& part : parts) sum += double(part.pixels()[i]);
      const double wanted = double(whole.pixels()[i]);
      for (image::Image& part : parts)
        part.pixels()[i] = float(sum > 0 ? double(part.pixels()[i]) * (wanted / sum) : &part == &parts[0] ? wanted : 0);
    }
  });
}

}  // namespace dapple::denoise
