// SPDX-License-Identifier: Apache-2.0
#include "dapple/image/texture_source.h"

#include <Imath/half.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "dapple/image/mip_pyramid.h"

namespace dapple::image {

namespace {

// Of texels that are cut away: in half precision a colour keeps its digits at it.
constexpr float unnoticed_weight = 1.0f / 1024;

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

std::vector<float> alpha_weights(const Image& image) {
  const int alpha = image.alpha_channel();
  if (image.channels() < 2 || alpha < 0) return {};
  std::vector<float> weights(pixel_count(image));
  for (size_t i = 0; i < weights.size(); ++i) {
    const float a = image.pixels()[i * size_t(image.channels()) + size_t(alpha)];
    weights[i] = a > 0 ? std::min(a, 1.0f) : 0;
  }
  const auto differs = [&](float w) { return w != weights[0]; };
  return std::any_of(weights.begin(), weights.end(), differs) ? weights : std::vector<float>();
}

void divide_by_alpha(Image& image) {
  const int alpha = image.alpha_channel(), channels = image.channels();
  if (channels < 2 || alpha < 0) return;
  for (float* p = image.pixels().data(); p != image.pixels().data() + image.pixels().size(); p += channels)
    if (p[alpha] > 0 && p[alpha] < 1)
      for (int c = 0; c < channels; ++c)
        if (c != alpha) p[c] /= p[alpha];
}

Image weighted_texels(const Image& color, std::span<const float> weights) {
  const int channels = color.channels();
  std::vector<std::string> names = color.channel_names();
  names.push_back("weight");
  std::vector<Image> levels;
  levels.emplace_back(color.width(), color.height(), channels + 1, names);
  for (size_t i = 0; i < weights.size(); ++i) {
    float* to = &levels[0].pixels()[i * size_t(channels + 1)];
    for (int c = 0; c < channels; ++c)
      to[c] = weights[i] > 0 ? color.pixels()[i * size_t(channels) + size_t(c)] * weights[i] : 0;
    to[channels] = weights[i];
  }
  while (levels.back().width() > 1 || levels.back().height() > 1) levels.push_back(half_size(levels.back()));
  Image& texels = levels[0];
  for (int y = 0; y < texels.height(); ++y)
    for (int x = 0; x < texels.width(); ++x) {
      float* to = texels.pixel(x, y);
      if (to[channels] >= unnoticed_weight) continue;
      const float* around = to;
      for (size_t l = 1; l < levels.size() && !(around[channels] > 0); ++l)
        around = levels[l].pixel(std::min(x >> l, levels[l].width() - 1), std::min(y >> l, levels[l].height() - 1));
      const float scale = around[channels] > 0 ? unnoticed_weight / around[channels] : 0;
      for (int c = 0; c < channels; ++c) to[c] = around[c] * scale;
      to[channels] = unnoticed_weight;
    }
  return std::move(texels);
}

std::optional<std::array<float, 3>> uniform_value(const Image& image, std::span<const float> weights) {
  const std::span<const float> p = image.pixels();
  const size_t channels = static_cast<size_t>(image.channels());
  const float* first = nullptr;
  for (size_t i = 0; i < pixel_count(image); ++i) {
    if (!weights.empty() && !(weights[i] > 0)) continue;
    const float* const at = &p[i * channels];
    if (!first) first = at;
    if (!std::equal(at, at + channels, first)) return std::nullopt;
  }
  if (!first) return std::nullopt;
  return channels == 3 ? std::array{first[0], first[1], first[2]} : std::array{first[0], first[0], first[0]};
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
