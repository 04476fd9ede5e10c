// SPDX-License-Identifier: Apache-2.0
#include "dapple/image/display_view.h"

#include <OpenImageIO/color.h>
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "dapple/base/input_file.h"

namespace dapple::image {

namespace {

float finite(float v) {
  return std::isnan(v) ? 0.0f : std::clamp(v, -1e30f, 1e30f);
}

/// Grey repeated as R, G and B: views work on colours.
Image with_rgb(const Image& image) {
  if (image.channels() >= 3) return image;
  return image.channels() == 1 ? image.select(std::array{0, 0, 0}) : image.select(std::array{0, 0, 0, 1});
}

/// Undoes the multiplication by alpha and leaves only finite numbers.
void unmultiply(Image& image) {
  const int channels = image.channels();
  const int alpha = channels == 2 || channels == 4 ? channels - 1 : -1;
  for (size_t i = 0; i < image.pixels().size(); i += channels) {
    float* p = &image.pixels()[i];
    for (int c = 0; c < channels; ++c) p[c] = finite(p[c]);
    if (alpha < 0) continue;
    p[alpha] = std::clamp(p[alpha], 0.0f, 1.0f);
    for (int c = 0; c < alpha; ++c) p[c] = p[alpha] > 0 ? p[c] / p[alpha] : p[c];
  }
}

template <class F>
void change_colours(Image& image, const F& change) {
  const int channels = image.channels();
  const int colours = channels == 2 || channels == 4 ? channels - 1 : channels;
  for (size_t i = 0; i < image.pixels().size(); i += channels)
    for (int c = 0; c < colours; ++c) change(&image.pixels()[i + c]);
}

float filmic(float x) {
  const auto curve = [](float v) {
    constexpr float A = 0.22f, B = 0.3f, C = 0.1f, D = 0.2f, E = 0.01f, F = 0.3f;
    return (v * (A * v + C * B) + D * E) / (v * (A * v + B) + D * F) - E / F;
  };
  constexpr float white = 11.2f;
  const float bright = std::clamp(2 * x, 0.0f, white);  // its curve is for pictures a stop brighter
  return curve(bright) / curve(white);
}

void encode_srgb(Image& image) {
  change_colours(image, [](float* v) { *v = std::clamp(linear_to_srgb(*v), 0.0f, 1.0f); });
}

bool is_filmic(const DisplayView& view) {
  return view.view == "filmic" && view.display.empty() && view.config.empty() && !std::getenv("OCIO");
}

std::string list(const std::vector<std::string>& names) {
  const std::vector<std::string_view> views(names.begin(), names.end());
  return one_of(views);
}

void check_names(const OIIO::ColorConfig& config, const std::string& display, const std::string& view) {
  const std::vector<std::string> displays = config.getDisplayNames();
  if (std::find(displays.begin(), displays.end(), display) == displays.end())
    throw UsageError("unknown display \"" + display + "\", " + list(displays));
  const std::vector<std::string> views = config.getViewNames(display);
  if (std::find(views.begin(), views.end(), view) == views.end())
    throw UsageError("unknown view \"" + view + "\" of display \"" + display + "\", " + list(views));
}

std::string config_name(const DisplayView& view) {
  const char* const from_environment = std::getenv("OCIO");
  return !view.config.empty() || !from_environment ? view.config : from_environment;
}

[[noreturn]] void refuse_config(const DisplayView& view, const std::string& why) {
  throw IoError("cannot use the OpenColorIO configuration \"" + config_name(view) + "\": " + why);
}

// OpenColorIO would wait for a pipe.
void check_config_file(const DisplayView& view) {
  const std::string name = config_name(view);
  if (name.empty() || name.rfind("ocio://", 0) == 0) return;
  if (const std::string why = why_unreadable(name); !why.empty()) refuse_config(view, why);
}

/// The display, after checks that the configuration has it, and the view.
std::string display_of(OIIO::ColorConfig& config, const DisplayView& view) {
  if (config.error() || !config.supportsOpenColorIO()) {
    if (config_name(view).empty())
      throw UsageError("the view \"" + view.view +
                       "\" needs an OpenColorIO configuration; expected one given by --ocio or $OCIO");
    refuse_config(view, config.geterror());
  }
  const std::string display = view.display.empty() ? std::string(config.getDefaultDisplayName()) : view.display;
  check_names(config, display, view.view);
  return display;
}

void encode_ocio(Image& image, const DisplayView& view) {
  check_config_file(view);
  OIIO::ColorConfig config(view.config);
  const std::string display = display_of(config, view);
  image = with_rgb(image);
  const OIIO::ImageSpec spec(image.width(), image.height(), image.channels(), OIIO::TypeDesc::FLOAT);
  OIIO::ImageBuf buffer(spec, image.pixels().data());
  const char* from = config.getColorSpaceNameByRole("scene_linear");
  if (!OIIO::ImageBufAlgo::ociodisplay(buffer, buffer, display, view.view, from ? from : "linear", "", false, "", "",
                                       &config))
    throw IoError("the view \"" + view.view + "\" failed: " + buffer.geterror());
  for (float& v : image.pixels()) v = std::clamp(finite(v), 0.0f, 1.0f);
}

}  // namespace

void check_view(const DisplayView& view) {
  if (view.view.empty() && !view.display.empty()) throw UsageError("a display is given without a view");
  if (view.view.empty() || is_filmic(view)) return;
  check_config_file(view);
  OIIO::ColorConfig config(view.config);
  display_of(config, view);
}

Image first_layer(const OutputImage& image) {
  const ImageLayer& layer = image.layers.front();
  Image all(image.width, image.height, static_cast<int>(layer.channels.size()), layer.channels);
  std::copy(layer.pixels.begin(), layer.pixels.end(), all.pixels().begin());
  const int r = all.channel("R"), g = all.channel("G"), b = all.channel("B"), a = all.channel("A");
  std::vector<int> wanted{0};
  if (r >= 0 && g >= 0 && b >= 0)
    wanted = {r, g, b};
  else if (all.channels() >= 3)
    wanted = {0, 1, 2};
  if (a >= 0 && std::find(wanted.begin(), wanted.end(), a) == wanted.end()) wanted.push_back(a);
  return all.select(wanted);
}

float exposure_of(const OutputImage& output) {
  const Image image = first_layer(output);
  const int channels = image.channels();
  std::vector<float> logs;
  for (size_t i = 0; i < image.pixels().size(); i += size_t(channels)) {
    const float* p = &image.pixels()[i];
    const float Y = channels >= 3 ? RGB(p[0], p[1], p[2]).luminance() : p[0];
    if (Y > 1e-12f && std::isfinite(Y)) logs.push_back(std::log2(Y));
  }
  if (logs.empty()) return 0;
  std::sort(logs.begin(), logs.end());
  const size_t cut = logs.size() / 20;
  double sum = 0;
  for (size_t i = cut; i < logs.size() - cut; ++i) sum += double(logs[i]);
  return std::log2(0.18f) - float(sum / double(logs.size() - 2 * cut));
}

Image apply_view(const OutputImage& output, const DisplayView& view) {
  Image image = first_layer(output);
  unmultiply(image);
  if (const float stops = view.exposure + (view.auto_exposure ? exposure_of(output) : 0); stops != 0)
    change_colours(image, [scale = std::exp2(stops)](float* v) { *v = finite(*v * scale); });
  if (is_filmic(view)) change_colours(image, [](float* v) { *v = filmic(*v); });
  if (view.view.empty() || is_filmic(view)) {
    check_view(view);
    encode_srgb(image);
  } else {
    encode_ocio(image, view);
  }
  return image;
}

}  // namespace dapple::image
