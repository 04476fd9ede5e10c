// SPDX-License-Identifier: Apache-2.0
#include "dapple/image/image.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace dapple::image {

float srgb_to_linear(float v) {
  const float a = std::abs(v);
  return std::copysign(a <= 0.04045f ? a / 12.92f : std::pow((a + 0.055f) / 1.055f, 2.4f), v);
}

float linear_to_srgb(float v) {
  const float a = std::abs(v);
  return std::copysign(a <= 0.0031308f ? a * 12.92f : 1.055f * std::pow(a, 1 / 2.4f) - 0.055f, v);
}

Encoding Encoding::parse(std::string_view name, const FileLoc& loc) {
  if (name == "sRGB" || name == "srgb") return srgb();
  if (name == "linear") return linear();
  if (name == "automatic") return automatic();
  if (name.starts_with("gamma ")) {
    const std::string_view number = name.substr(6);
    float g = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), g);
    if (error == std::errc() && end == number.data() + number.size() && g > 0 && g < 100) return gamma(g);
  }
  throw InputError(loc, "unknown encoding \"" + std::string(name) + "\", " +
                            one_of({"sRGB", "linear", "gamma G (G a positive number)", "automatic"}));
}

float Encoding::decode(float v) const {
  switch (kind) {
    case Kind::srgb:
      return srgb_to_linear(v);
    case Kind::gamma:
      return std::copysign(std::pow(std::abs(v), exponent), v);
    case Kind::automatic:
    case Kind::linear:
      break;
  }
  return v;
}

namespace {
std::vector<std::string> default_names(int channels) {
  switch (channels) {
    case 1:
      return {"Y"};
    case 2:
      return {"Y", "A"};
    case 3:
      return {"R", "G", "B"};
    case 4:
      return {"R", "G", "B", "A"};
  }
  std::vector<std::string> names;
  for (int i = 0; i < channels; ++i) names.push_back("channel" + std::to_string(i));
  return names;
}

bool is_alpha(std::string_view name) {
  return name == "A" || name == "a" || name == "alpha" || name == "Alpha" || name == "ALPHA";
}
}  // namespace

Image::Image(int width, int height, int channels, std::vector<std::string> channel_names)
    : width_(width),
      height_(height),
      channel_names_(channel_names.empty() ? default_names(channels) : std::move(channel_names)),
      pixels_(static_cast<size_t>(width) * height * channel_names_.size()) {}

int Image::channel(std::string_view name) const {
  const auto at = std::find(channel_names_.begin(), channel_names_.end(), name);
  return at == channel_names_.end() ? -1 : static_cast<int>(at - channel_names_.begin());
}

int Image::alpha_channel() const {
  const auto at = std::find_if(channel_names_.begin(), channel_names_.end(), is_alpha);
  return at == channel_names_.end() ? -1 : static_cast<int>(at - channel_names_.begin());
}

RGB Image::rgb(int x, int y) const {
  const float* p = pixel(x, y);
  const int r = channel("R"), g = channel("G"), b = channel("B");
  if (r >= 0 && g >= 0 && b >= 0) return {p[r], p[g], p[b]};
  return channels() >= 3 ? RGB(p[0], p[1], p[2]) : RGB(p[0]);
}

bool ImageInfo::has_alpha() const {
  return channels > 1 && std::any_of(channel_names.begin(), channel_names.end(), is_alpha);
}

Image Image::select(std::span<const int> wanted) const {
  std::vector<std::string> names;
  for (const int c : wanted) names.push_back(channel_names_[c]);
  Image out(width_, height_, static_cast<int>(wanted.size()), std::move(names));
  const size_t n = static_cast<size_t>(width_) * height_, from = channels(), to = wanted.size();
  for (size_t i = 0; i < n; ++i)
    for (size_t c = 0; c < to; ++c) out.pixels_[i * to + c] = pixels_[i * from + wanted[c]];
  return out;
}

}  // namespace dapple::image
