// SPDX-License-Identifier: Apache-2.0
#include "dapple/render/frame_denoiser.h"

#include <filesystem>
#include <functional>

#include "dapple/base/parallel.h"

namespace dapple::render {

using image::Image;
using scene::Film;

namespace {

Image picture_of(const Film& film, const std::function<RGB(int x, int y)>& value) {
  Image picture(film.width(), film.height(), 3);
  const V2i corner = film.settings().crop.min;
  parallel_for(size_t(film.height()), [&](size_t y) {
    for (int x = 0; x < film.width(); ++x) {
      const RGB c = value(corner.x + x, corner.y + int(y));
      for (int i = 0; i < 3; ++i) picture.pixel(x, int(y))[i] = c[i];
    }
  });
  return picture;
}

template <class Triple>
Image image_of(const std::vector<Triple>& values, int width, int height) {
  Image picture(width, height, 3);
  for (size_t i = 0; i < values.size(); ++i)
    for (int c = 0; c < 3; ++c) picture.pixels()[3 * i + size_t(c)] = values[i][c];
  return picture;
}

void add_up_to(const Image& whole, std::vector<Image>& parts) {
  if (parts.empty()) return;
  for (size_t i = 0; i < whole.pixels().size(); ++i) {
    double sum = 0;
    for (const Image& part : parts) sum += double(part.pixels()[i]);
    const double wanted = double(whole.pixels()[i]);
    for (Image& part : parts) part.pixels()[i] = float(sum > 0 ? double(part.pixels()[i]) * (wanted / sum) : &part == &parts[0] ? wanted : 0);
  }
}

}  // namespace

FeatureLayers trace_features(const scene::Scene& scene, const Box2i& crop, const integrate::FeatureTracer::Settings& settings) {
  const auto layers = integrate::FeatureTracer(scene, settings).trace(crop);
  const int width = crop.max.x - crop.min.x, height = crop.max.y - crop.min.y;
  return {image_of(layers.albedo, width, height), image_of(layers.normal, width, height)};
}

FrameDenoiser::FrameDenoiser(const std::string& weights) : weights_(std::filesystem::path(weights).filename().string()), denoiser_(weights) {}

std::string FrameDenoiser::description() const { return weights_ + ", " + denoise::instruction_set(); }

DenoisedFrame FrameDenoiser::operator()(const Film& film, const FeatureLayers* features, StopToken stop) const {
  const Image* const albedo = features ? &features->albedo : nullptr;
  const Image* const normal = features ? &features->normal : nullptr;
  const auto denoised = [&](const std::function<RGB(int x, int y)>& value) { return denoiser_(picture_of(film, value), albedo, normal, {.stop = stop}); };
  DenoisedFrame frame;
  frame.colour = denoised([&](int x, int y) { return film.pixel(x, y); });
  for (int g = 0; g < film.settings().light_groups; ++g)
    frame.light_groups.push_back(denoised([&](int x, int y) { return film.light_group(x, y, g); }));
  add_up_to(frame.colour, frame.light_groups);
  return frame;
}

}  // namespace dapple::render
