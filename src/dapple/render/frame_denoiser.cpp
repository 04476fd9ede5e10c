// SPDX-License-Identifier: Apache-2.0
#include "dapple/render/frame_denoiser.h"

#include <optional>

#include "dapple/denoise/clean_pixels.h"
#include "dapple/denoise/denoise_apart.h"
#include "dapple/denoise/transfer.h"
#include "dapple/integrate/motion_tracer.h"

namespace dapple::render {

using image::Image;
using scene::Film;

namespace {

/// A film's picture, the part of it that is direct light, or that of a light group.
class FilmRows final : public denoise::PixelRows {
 public:
  static constexpr int all = -1, direct = -2;
  FilmRows(const Film& film, int part) : PixelRows(film.width(), film.height()), film_(film), part_(part) {}
  void read(int y, int begin, int end, float* out) const override {
    const V2i corner = film_.settings().crop.min;
    for (int x = begin; x < end; ++x) {
      const int px = corner.x + x, py = corner.y + y;
      const RGB c = part_ == all      ? film_.pixel(px, py)
                    : part_ == direct ? film_.direct(px, py)
                                      : film_.light_group(px, py, part_);
      for (int i = 0; i < 3; ++i) *out++ = c[i];
    }
  }

 private:
  const Film& film_;
  const int part_;  ///< a group's number, or one of the above
};

/// Variances of a film's pixels.
class VarianceRows final : public denoise::PixelRows {
 public:
  explicit VarianceRows(const Film& film) : PixelRows(film.width(), film.height()), film_(film) {}
  void read(int y, int begin, int end, float* out) const override {
    const V2i corner = film_.settings().crop.min;
    for (int x = begin; x < end; ++x) {
      const RGB v = film_.variance(corner.x + x, corner.y + y);
      for (int i = 0; i < 3; ++i) *out++ = v[i];
    }
  }

 private:
  const Film& film_;
};

bool tells_variance(const Film& film) {
  const Box2i& crop = film.settings().crop;
  for (int y = crop.min.y; y < crop.max.y; ++y)
    for (int x = crop.min.x; x < crop.max.x; ++x)
      if (film.samples(x, y) < denoise::least_samples_for_variance) return false;
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
                   StopToken stop) {
  return image_of(integrate::MotionTracer(scene, settings).trace(crop, stop), crop.max.x - crop.min.x,
                  crop.max.y - crop.min.y);
}

FrameDenoiser::FrameDenoiser(const std::string& weights) : denoiser_(weights) {}

DenoisedFrame FrameDenoiser::operator()(const Film& film, const FeatureLayers* features, const Options& options) const {
  std::optional<denoise::ImageRows> albedo, normal;
  if (features) albedo.emplace(features->albedo), normal.emplace(features->normal);
  const denoise::PixelRows *const a = albedo ? &*albedo : nullptr, *const n = normal ? &*normal : nullptr;
  const FilmRows all(film, FilmRows::all);
  DenoisedFrame frame;
  frame.exposure = options.exposure > 0 ? options.exposure : denoise::auto_exposure(all);
  const denoise::Denoiser::Options of_all{.exposure = frame.exposure, .stop = options.stop};
  frame.colour = film.settings().direct && !film.has_gains()
                     ? denoise::denoise_apart(denoiser_, all, FilmRows(film, FilmRows::direct), a, n, of_all)
                     : denoiser_(all, a, n, of_all);
  if (options.independent && !film.has_gains() && tells_variance(film))
    denoise::keep_clean_pixels(all, VarianceRows(film), &frame.colour);
  for (int g = 0; g < options.light_groups; ++g)
    frame.light_groups.push_back(denoiser_(FilmRows(film, g), a, n, {.stop = options.stop}));
  denoise::add_up_to(frame.colour, frame.light_groups);
  return frame;
}

}  // namespace dapple::render
