// SPDX-License-Identifier: Apache-2.0
#include "dapple/render/frame_denoiser.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "dapple/denoise/clean_pixels.h"
#include "dapple/denoise/denoise_apart.h"
#include "dapple/denoise/error_estimate.h"
#include "dapple/denoise/mean_restoration.h"
#include "dapple/denoise/transfer.h"

namespace dapple::render {

using image::Image;
using scene::Film;

namespace {

/// A colour that a film keeps of each pixel; some have numbers.
class FilmRows final : public denoise::PixelRows {
 public:
  using Value = RGB (*)(const Film&, int x, int y, int which);
  FilmRows(const Film& film, Value value, int which = 0)
      : PixelRows(film.width(), film.height()), film_(film), value_(value), which_(which) {}
  void read(int y, int begin, int end, float* out) const override {
    const V2i corner = film_.settings().crop.min;
    for (int x = begin; x < end; ++x) {
      const RGB c = value_(film_, corner.x + x, corner.y + y, which_);
      for (int i = 0; i < 3; ++i) *out++ = c[i];
    }
  }

 private:
  const Film& film_;
  const Value value_;
  const int which_;
};

RGB picture(const Film& film, int x, int y, int) {
  return film.pixel(x, y);
}
RGB direct(const Film& film, int x, int y, int) {
  return film.direct(x, y);
}
RGB light_group(const Film& film, int x, int y, int group) {
  return film.light_group(x, y, group);
}
RGB half(const Film& film, int x, int y, int which) {
  return film.half(x, y, which);
}
RGB half_direct(const Film& film, int x, int y, int which) {
  return film.half_direct(x, y, which);
}
// Infinite below two samples, which cannot tell.
RGB known_variance(const Film& film, int x, int y, int) {
  return film.samples(x, y) < 2 ? RGB(infinity) : film.variance(x, y);
}
RGB variance(const Film& film, int x, int y, int) {
  return film.variance(x, y);
}
RGB half_variance(const Film& film, int x, int y, int which) {
  const auto share = float(film.half_share(x, y, which));
  return share > 0 ? film.variance(x, y) / share : RGB(infinity);
}

bool has_samples(const Film& film, uint32_t samples) {
  const Box2i& crop = film.settings().crop;
  for (int y = crop.min.y; y < crop.max.y; ++y)
    for (int x = crop.min.x; x < crop.max.x; ++x)
      if (film.samples(x, y) < samples) return false;
  return true;
}

template <class Triple>
Image image_of(const std::vector<Triple>& values, int width, int height) {
  Image picture(width, height, 3);
  for (size_t i = 0; i < values.size(); ++i)
    for (int c = 0; c < 3; ++c) picture.pixels()[3 * i + size_t(c)] = values[i][c];
  return picture;
}

}  // namespace

FeatureLayers trace_features(const scene::Scene& scene, const Box2i& crop,
                             const integrate::FeatureTracer::Settings& settings, StopToken stop) {
  const auto layers = integrate::FeatureTracer(scene, settings).trace(crop, stop);
  const int width = crop.max.x - crop.min.x, height = crop.max.y - crop.min.y;
  return {image_of(layers.albedo, width, height), image_of(layers.normal, width, height)};
}

Image trace_motion(const scene::Scene& scene, const Box2i& crop, const integrate::FeatureTracer::Settings& settings,
                   StopToken stop, const integrate::NeighbourScene* to) {
  const integrate::MotionTracer tracer(scene, settings);
  return image_of(to ? tracer.trace(crop, *to, stop) : tracer.trace(crop, stop), crop.max.x - crop.min.x,
                  crop.max.y - crop.min.y);
}

Image standard_errors(const Film& film, const DenoisedFrame* denoised, bool loops) {
  Image errors = denoised ? denoised->squared_error : denoise::smooth_variance(FilmRows(film, known_variance), loops);
  for (float& e : errors.pixels()) e = std::sqrt(e);
  return errors;
}

FrameDenoiser::FrameDenoiser(const std::string& weights) : denoiser_(weights) {}

/// What the network makes of parts of a film, and what it is told beside them.
struct FrameDenoiser::Layers {
  const denoise::PixelRows &colour, *direct, *variance, *albedo, *normal;  ///< all but colour may be null
  bool independent;                                                        ///< Options::independent
};

Image FrameDenoiser::denoise(const Layers& l, const denoise::Denoiser::Options& options) const {
  Image image = l.direct ? denoise::denoise_apart(denoiser_, l.colour, *l.direct, l.albedo, l.normal, options)
                         : denoiser_(l.colour, l.albedo, l.normal, options);
  if (l.variance) denoise::restore_means(l.colour, *l.variance, options.exposure, &image);
  if (l.variance && l.independent) denoise::keep_clean_pixels(l.colour, *l.variance, &image);
  return image;
}

DenoisedFrame FrameDenoiser::operator()(const Film& film, const FeatureLayers* features, const Options& options) const {
  std::optional<denoise::ImageRows> albedo, normal;
  if (features) albedo.emplace(features->albedo), normal.emplace(features->normal);
  const denoise::PixelRows *const a = albedo ? &*albedo : nullptr, *const n = normal ? &*normal : nullptr;
  const FilmRows all(film, picture), of_direct(film, direct), of_noise(film, variance);
  const bool apart = film.settings().direct && !film.has_gains();
  const bool knows_noise = !film.has_gains() && has_samples(film, denoise::least_samples_for_variance);
  DenoisedFrame frame;
  frame.exposure = options.exposure > 0 ? options.exposure : denoise::auto_exposure(all);
  const denoise::Denoiser::Options of_all{.exposure = frame.exposure, .stop = options.stop};
  frame.colour = denoise(
      {all, apart ? &of_direct : nullptr, knows_noise ? &of_noise : nullptr, a, n, options.independent}, of_all);
  if (options.estimates_error && !has_samples(film, denoise::least_samples_for_error)) {
    frame.relative_square = frame.squared_error = Image(film.width(), film.height(), 1);
    for (Image* unknown : {&frame.relative_square, &frame.squared_error})
      std::fill(unknown->pixels().begin(), unknown->pixels().end(), infinity);
  } else if (options.estimates_error) {
    if (!film.settings().halves || film.has_gains()) throw std::logic_error("errors are estimated by half films");
    Image halves[2];
    for (int i = 0; i < 2; ++i) {
      const FilmRows colour(film, half, i), of_half(film, half_direct, i), half_noise(film, half_variance, i);
      halves[i] = denoise(
          {colour, apart ? &of_half : nullptr, knows_noise ? &half_noise : nullptr, a, n, options.independent}, of_all);
    }
    frame.relative_square =
        denoise::relative_error({FilmRows(film, half, 0), FilmRows(film, half, 1), frame.colour, halves[0], halves[1]});
    // Of unequal halves the mean error is larger beside the whole's: 1 / n + 1 / m in place of 4 / (n + m).
    const V2i corner = film.settings().crop.min;
    for (int y = 0; y < film.height(); ++y)
      for (int x = 0; x < film.width(); ++x)
        frame.relative_square.pixel(x, y)[0] *=
            float(4 * film.half_share(corner.x + x, corner.y + y, 0) * film.half_share(corner.x + x, corner.y + y, 1));
    frame.squared_error = frame.relative_square;
    denoise::multiply_by_light(frame.colour, &frame.squared_error);
  }
  for (int g = 0; g < options.light_groups; ++g)
    frame.light_groups.push_back(denoiser_(FilmRows(film, light_group, g), a, n, {.stop = options.stop}));
  denoise::add_up_to(frame.colour, frame.light_groups);
  return frame;
}

}  // namespace dapple::render
