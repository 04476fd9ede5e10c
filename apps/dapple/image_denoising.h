// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "dapple/denoise/denoiser.h"
#include "dapple/denoise/layer_names.h"
#include "dapple/image/exr_file.h"

namespace dapple::app {

/// A layer of a file, which must outlive this.
class LayerRows final : public denoise::PixelRows {
 public:
  LayerRows(const image::ExrFile& file, const denoise::Layer& layer)
      : PixelRows(file.parts()[layer.part].width, file.parts()[layer.part].height), file_(file), layer_(layer) {}
  void read(int y, int begin, int end, float* out) const override {
    file_.read(layer_.part, layer_.channels, y, begin, end, out);
  }

 private:
  const image::ExrFile& file_;
  const denoise::Layer layer_;
};

/// Networks by what pictures have, each loaded when it is first wanted.
class Networks {
 public:
  /// Of no weights: those that go with each picture. Errors as denoise::Denoiser.
  explicit Networks(const std::string& weights);

  /// InputError where the network wants more than the picture has; a warning where it is done by colour alone, once for
  /// all pictures of a name.
  const denoise::Denoiser& for_picture(const std::string& path, const image::ExrFile& file,
                                       const denoise::Picture& picture);

 private:
  const denoise::Denoiser& get(const std::string& path);

  std::string weights_;
  std::map<std::string, std::unique_ptr<const denoise::Denoiser>> networks_;
  std::set<std::string> warned_of_;
};

/// "R G B", or the layer's name.
std::string title(const denoise::Layer& layer);
/// InputError where a layer has another data window than `colour`.
void check_window(const std::string& path, const image::ExrFile& file, size_t part, const std::string& name,
                  const denoise::Layer& colour);
/// The pictures of a file. InputError where there is none, or one that has another data window than a layer by which
/// dapple denoise IMAGE denoises it.
std::vector<denoise::Picture> pictures_of(const std::string& path, const image::ExrFile& file);
/// Exposures beyond these would leave nothing of a picture in single precision.
inline constexpr float least_exposure = 1e-9f, most_exposure = 1e9f;
/// Denoiser::Options::exposure, as the header of Dapple's denoised images tells it; else, or beyond bounds, 0.
float exposure_of(const image::ExrFile& file, const denoise::Picture& picture);
/// Whether the file has variances of independent samples, and enough of these, as Dapple's path tracer writes them.
bool tells_variance(const image::ExrFile& file, const denoise::Picture& picture);
/// "no layer of normals", say.
std::string missing_layers(const denoise::Picture& picture);
/// Denoises a picture of a file, and its light groups, by itself. Returns Denoiser::description().
std::string denoise_picture(const std::string& path, const denoise::Picture& picture, Networks& networks,
                            image::ExrFile* file);
/// Warns of pixels that are not finite.
void warn_of_odd(const std::string& path, const denoise::Layer& layer, const denoise::PixelRows& rows);

}  // namespace dapple::app
