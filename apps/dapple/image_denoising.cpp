// SPDX-License-Identifier: Apache-2.0
#include "image_denoising.h"

#include <cmath>
#include <optional>

#include "dapple/base/log.h"
#include "dapple/base/parallel.h"
#include "dapple/denoise/clean_pixels.h"
#include "dapple/denoise/denoise_apart.h"
#include "dapple/denoise/mean_restoration.h"
#include "dapple/denoise/transfer.h"
#include "dapple/denoise/weights.h"

namespace dapple::app {

using denoise::Denoiser;
using denoise::Layer;
using denoise::Picture;
using image::ExrFile;

void check_window(const std::string& path, const ExrFile& file, size_t part, const std::string& name,
                  const Layer& colour) {
  const ExrFile::Part &a = file.parts()[part], &b = file.parts()[colour.part];
  if (a.width != b.width || a.height != b.height || a.x != b.x || a.y != b.y)
    throw InputError(FileLoc{path}, "layer \"" + name + "\" has another data window than \"" + title(colour) + "\"");
}

Networks::Networks(const std::string& weights) : weights_(weights) {
  if (!weights.empty()) get(weights);  // before work begins
}

const Denoiser& Networks::for_picture(const std::string& path, const ExrFile& file, const Picture& picture) {
  const std::string missing = missing_layers(picture), layers = "; its layers are " + denoise::list_layers(file);
  if (!weights_.empty()) {
    const Denoiser& network = get(weights_);
    if ((network.inputs() > 3 && !picture.albedo) || (network.inputs() > 6 && !picture.normal))
      throw InputError(FileLoc{path}, "there is " + missing + " for \"" + weights_ + "\"" + layers);
    return network;
  }
  if (picture.albedo && picture.normal) return get(denoise::weights_path(denoise::feature_weights));
  if (warned_of_.insert(title(picture.colour)).second)
    log_warning(path + ": denoised by colour alone, which keeps less detail: there is " + missing + layers);
  return get(denoise::weights_path(denoise::color_weights));
}

const Denoiser& Networks::get(const std::string& path) {
  std::unique_ptr<const Denoiser>& network = networks_[path];
  if (!network) network = std::make_unique<const Denoiser>(path);
  return *network;
}

std::string title(const Layer& layer) {
  return layer.name.empty() ? "R G B" : layer.name;
}

std::vector<Picture> pictures_of(const std::string& path, const ExrFile& file) {
  const std::vector<Picture> pictures = denoise::find_pictures(file);
  if (pictures.empty())
    throw InputError(FileLoc{path},
                     "there is no picture to denoise; expected channels R, G and B, or a layer Combined, Ci, beauty, "
                     "color or rgba; its layers are " +
                         denoise::list_layers(file));
  for (const Picture& p : pictures) {
    const auto check = [&](const Layer& layer) { check_window(path, file, layer.part, title(layer), p.colour); };
    check(p.noisy);
    for (const auto& layer : {p.albedo, p.normal, p.direct})
      if (layer) check(*layer);
    if (tells_variance(file, p)) check(*p.variance);
    for (const Layer& group : p.light_groups) check(group);
  }
  return pictures;
}

float exposure_of(const ExrFile& file, const Picture& picture) {
  const bool is_frame = picture.colour.name.empty() || picture.colour.name == "rgb";  // as `dapple render` names it
  const float told = is_frame ? file.number("dapple/denoiseExposure").value_or(0) : 0;
  return told >= least_exposure && told <= most_exposure ? told : 0;
}

bool tells_variance(const ExrFile& file, const Picture& picture) {
  return picture.variance && file.number("dapple/samples").value_or(0) >= denoise::least_samples_for_variance;
}

std::string missing_layers(const Picture& picture) {
  return !picture.albedo && !picture.normal ? "no layer of albedo and none of normals"
         : picture.albedo                   ? "no layer of normals"
                                            : "no layer of albedo";
}

void warn_of_odd(const std::string& path, const Layer& layer, const denoise::PixelRows& rows) {
  std::vector<size_t> odd(size_t(rows.height()));
  parallel_for(odd.size(), [&](size_t y) {
    std::vector<float> row(3 * size_t(rows.width()));
    rows.read(int(y), 0, rows.width(), row.data());
    for (size_t x = 0; x < row.size(); x += 3)
      odd[y] += !std::isfinite(row[x]) || !std::isfinite(row[x + 1]) || !std::isfinite(row[x + 2]);
  });
  size_t sum = 0;
  for (const size_t n : odd) sum += n;
  if (sum > 0)
    log_warning(path + ": " + std::to_string(sum) + " pixels of \"" + title(layer) +
                "\" are not finite, and count as black there");
}

image::Image image_of(const denoise::PixelRows& rows) {
  image::Image image(rows.width(), rows.height(), 3);
  const size_t width = 3 * size_t(rows.width());
  for (int y = 0; y < rows.height(); ++y) rows.read(y, 0, rows.width(), &image.pixels()[size_t(y) * width]);
  return image;
}

std::string denoise_picture(const std::string& path, const Picture& picture, Networks& networks, ExrFile* file) {
  const Denoiser& network = networks.for_picture(path, *file, picture);
  std::optional<LayerRows> albedo, normal;
  const LayerRows colour(*file, picture.noisy);
  if (network.inputs() > 3) albedo.emplace(*file, *picture.albedo);
  if (network.inputs() > 6) normal.emplace(*file, *picture.normal);
  const auto denoised = [&](const denoise::PixelRows& rows, float exposure) {
    return network(rows, albedo ? &*albedo : nullptr, normal ? &*normal : nullptr, {.exposure = exposure});
  };
  const float exposure = exposure_of(*file, picture);
  const auto without_noise = [&] {
    if (!picture.direct) return denoised(colour, exposure);
    return denoise::denoise_apart(network, colour, LayerRows(*file, *picture.direct), albedo ? &*albedo : nullptr,
                                  normal ? &*normal : nullptr, {.exposure = exposure});
  };
  image::Image whole = without_noise();
  if (tells_variance(*file, picture)) {
    const LayerRows variance(*file, *picture.variance);
    denoise::restore_means(colour, variance, exposure > 0 ? exposure : denoise::auto_exposure(colour), &whole);
    if (file->number("dapple/independentSamples").value_or(0) == 1)
      denoise::keep_clean_pixels(colour, variance, &whole);
  }
  std::vector<image::Image> groups;
  const bool again = picture.noisy.part != picture.colour.part || picture.noisy.channels != picture.colour.channels;
  for (const Layer& group : picture.light_groups) {
    const LayerRows rows(*file, group);
    groups.push_back(again ? image_of(rows) : denoised(rows, 0));  // those of a denoised picture are so too
  }
  denoise::add_up_to(whole, groups);
  file->replace(picture.colour.part, picture.colour.channels, whole);
  for (size_t g = 0; g < groups.size(); ++g)
    file->replace(picture.light_groups[g].part, picture.light_groups[g].channels, groups[g]);
  return network.description();
}

}  // namespace dapple::app
