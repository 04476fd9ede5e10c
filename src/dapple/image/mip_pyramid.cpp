// SPDX-License-Identifier: Apache-2.0
#include "dapple/image/mip_pyramid.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "dapple/base/parallel.h"
#include "dapple/image/pixel_writer.h"

namespace dapple::image {

namespace {

constexpr int tile_size = 64;

/// The pixels [first, first + count) of one line that pixel `i` of a shorter line covers, and how much of each.
struct Cover {
  int first = 0, count = 0;
  std::array<float, 4> weights{};
};

std::vector<Cover> cover(int from, int to) {
  std::vector<Cover> covers(static_cast<size_t>(to));
  const double ratio = static_cast<double>(from) / to;  // at most 3: 3 pixels made 1
  for (int i = 0; i < to; ++i) {
    Cover& c = covers[static_cast<size_t>(i)];
    const double begin = i * ratio, end = (i + 1) * ratio;
    c.first = std::min(static_cast<int>(begin), from - 1);
    for (int j = c.first; j < from && c.count < 4; ++j) {
      const double overlap = std::min(end, j + 1.0) - std::max(begin, static_cast<double>(j));
      if (overlap < 1e-6) break;
      c.weights[static_cast<size_t>(c.count++)] = static_cast<float>(overlap / ratio);
    }
  }
  return covers;
}

float representable(float v, float limit) {
  return std::isnan(v) ? 0.0f : std::clamp(v, -limit, limit);
}

}  // namespace

Image half_size(const Image& image) {
  const int width = std::max(1, image.width() / 2), height = std::max(1, image.height() / 2);
  const int channels = image.channels();
  Image out(width, height, channels, image.channel_names());
  const std::vector<Cover> columns = cover(image.width(), width), rows = cover(image.height(), height);
  parallel_ranges(static_cast<size_t>(height), 16, [&](size_t begin, size_t end) {
    for (size_t y = begin; y < end; ++y)
      for (int x = 0; x < width; ++x) {
        const Cover &column = columns[static_cast<size_t>(x)], &row = rows[y];
        float* to = out.pixel(x, static_cast<int>(y));
        for (int j = 0; j < row.count; ++j)
          for (int i = 0; i < column.count; ++i) {
            const float w = row.weights[static_cast<size_t>(j)] * column.weights[static_cast<size_t>(i)];
            const float* from = image.pixel(column.first + i, row.first + j);
            for (int c = 0; c < channels; ++c) to[c] += w * from[c];
          }
      }
  });
  return out;
}

void write_mip_pyramid(const std::string& path, Image image, SampleType type) {
  const auto fail = [&](const std::string& why) {
    throw IoError("cannot write temporary texture \"" + path + "\": " + why);
  };
  const bool half = type == SampleType::half_float;
  const float limit = half ? 65504.0f : std::numeric_limits<float>::max();
  for (float& v : image.pixels()) v = representable(v, limit);

  const std::unique_ptr<OIIO::ImageOutput> out = OIIO::ImageOutput::create("openexr");
  if (!out) fail("this build cannot write OpenEXR images");
  OIIO::ImageSpec spec(image.width(), image.height(), image.channels(),
                       half ? OIIO::TypeDesc::HALF : OIIO::TypeDesc::FLOAT);
  spec.channelnames = image.channel_names();
  spec.tile_width = spec.tile_height = tile_size;
  // Half floats hardly shrink (by a quarter), and packing would cost more than all the rest.
  spec.attribute("compression", "none");
  spec.attribute("DateTime", "");
  spec.attribute("textureformat", "Plain Texture");
  spec.attribute("openexr:roundingmode", 0);
  for (bool first = true;; first = false) {
    spec.width = spec.full_width = image.width();
    spec.height = spec.full_height = image.height();
    if (!out->open(path, spec, first ? OIIO::ImageOutput::Create : OIIO::ImageOutput::AppendMIPLevel))
      fail(out->geterror());
    if (!write_pixels(*out, OIIO::TypeDesc::FLOAT, image.pixels().data())) fail(out->geterror());
    if (image.width() == 1 && image.height() == 1) break;
    image = half_size(image);
  }
  if (!out->close()) fail(out->geterror());
}

}  // namespace dapple::image
