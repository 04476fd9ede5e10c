// SPDX-License-Identifier: Apache-2.0
#include "dapple/image/texture_source.h"

#include <Imath/half.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace dapple::image {

namespace {

std::array<int, 3> color_channels(const Image& image) {
  const std::array<int, 3> named{image.channel("R"), image.channel("G"), image.channel("B")};
  return std::all_of(named.begin(), named.end(), [](int c) { return c >= 0; }) ? named : std::array{0, 1, 2};
}

size_t pixel_count(const Image& image) {
  return static_cast<size_t>(image.width()) * static_cast<size_t>(image.height());
}

bool has_transparency(const Image& image, int alpha) {
  const size_t channels = static_cast<size_t>(image.channels());
  for (size_t i = 0; i < pixel_count(image); ++i)
    if (image.pixels()[i * channels + static_cast<size_t>(alpha)] != 1) return true;
  return false;
}

bool is_grey(const Image& rgb) {
  const std::span<const float> p = rgb.pixels();
  for (size_t i = 0; i < p.size(); i += 3)
    if (p[i] != p[i + 1] || p[i] != p[i + 2]) return false;
  return true;
}

Image select_color(const Image& image) {
  if (image.channels() < 3) return image.select(std::array{0});
  Image rgb = image.select(color_channels(image));
  return is_grey(rgb) ? rgb.select(std::array{0}) : rgb;
}

Image select_scalar(const Image& image) {
  const int alpha = image.alpha_channel();
  if (image.channels() > 1 && alpha >= 0 && has_transparency(image, alpha)) return image.select(std::array{alpha});
  const Image color = select_color(image);
  if (color.channels() == 1) return color;
  Image mean(color.width(), color.height(), 1);
  for (size_t i = 0; i < pixel_count(color); ++i) {
    const float* p = &color.pixels()[3 * i];
    mean.pixels()[i] = (p[0] + p[1] + p[2]) / 3;
  }
  return mean;
}

}  // namespace

Image select_channels(const Image& image, TextureUse use) {
  return use == TextureUse::color ? select_color(image) : select_scalar(image);
}

std::optional<std::array<float, 3>> uniform_value(const Image& image) {
  const std::span<const float> p = image.pixels();
  const size_t channels = static_cast<size_t>(image.channels());
  for (size_t i = channels; i < p.size(); ++i)
    if (p[i] != p[i % channels]) return std::nullopt;
  return channels == 3 ? std::array{p[0], p[1], p[2]} : std::array{p[0], p[0], p[0]};
}

void quantize(Image& image, SampleType type) {
  const float limit = type == SampleType::half_float ? 65504.0f : std::numeric_limits<float>::max();
  for (float& v : image.pixels()) {
    v = std::isnan(v) ? 0.0f : std::clamp(v, -limit, limit);
    if (type == SampleType::half_float) v = static_cast<float>(Imath::half(v));
  }
}

SampleType storage_type(TextureUse use) {
  return use == TextureUse::scalar ? SampleType::full_float : SampleType::half_float;
}

bool usable_in_place(const ImageInfo& info, Encoding encoding, TextureUse use) {
  if (encoding.kind == Encoding::Kind::automatic) encoding = info.encoding;
  if (!info.tiled_mipmap || encoding.kind != Encoding::Kind::linear) return false;
  const std::vector<std::string>& names = info.channel_names;
  if (info.channels == 1) return true;
  return use == TextureUse::color && info.channels >= 3 && names[0] == "R" && names[1] == "G" && names[2] == "B";
}

}  // namespace dapple::image
