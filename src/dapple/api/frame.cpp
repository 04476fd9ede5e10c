// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>

#include "dapple/api/scene_impl.h"
#include "dapple/base/parallel.h"
#include "dapple/denoise/denoiser.h"
#include "dapple/denoise/weights.h"
#include "dapple/image/image.h"
#include "dapple/render/report.h"

namespace dapple {

using image::Image;
using image::OutputImage;

namespace {

Image image_of(const Layer& layer, const char* what) {
  if (layer.channels.size() != 3 || layer.width < 1 || layer.height < 1 ||
      layer.pixels.size() != size_t(layer.width) * size_t(layer.height) * 3)
    throw UsageError(std::string(what) + ": expected a layer of 3 channels");
  Image image(layer.width, layer.height, 3);
  std::copy(layer.pixels.begin(), layer.pixels.end(), image.pixels().begin());
  return image;
}

// "albedo.R" is channel R of layer albedo; what has a name in place of a letter is a layer of one channel.
std::string layer_name(const std::string& channel) {
  if (channel == "Z") return "depth";
  const size_t dot = channel.rfind('.');
  if (dot == std::string::npos) return channel.size() == 1 ? "" : channel;
  const std::string layer = channel.substr(0, dot);
  return layer == "P" ? "position" : layer;
}

HeaderValue header_value(const image::MetadataValue& value) {
  if (const auto* m = std::get_if<M44f>(&value)) {
    std::array<float, 16> rows;
    std::copy(m->getValue(), m->getValue() + 16, rows.begin());
    return rows;
  }
  if (const auto* i = std::get_if<int>(&value)) return *i;
  if (const auto* f = std::get_if<float>(&value)) return *f;
  return std::get<std::string>(value);
}

image::MetadataValue metadata_value(const HeaderValue& value) {
  if (const auto* rows = std::get_if<std::array<float, 16>>(&value)) {
    M44f m;
    std::copy(rows->begin(), rows->end(), m.getValue());
    return m;
  }
  if (const auto* i = std::get_if<int>(&value)) return *i;
  if (const auto* f = std::get_if<float>(&value)) return *f;
  return std::get<std::string>(value);
}

}  // namespace

namespace api {

Picture frame_of(OutputImage picture) {
  Picture frame;
  frame.origin_x = picture.origin.x, frame.origin_y = picture.origin.y;
  frame.film_width = picture.display_width, frame.film_height = picture.display_height;
  for (image::ImageLayer& l : picture.layers)
    frame.layers.push_back({frame.layers.empty() ? "" : std::move(l.name), std::move(l.channels), picture.width,
                            picture.height, std::move(l.pixels)});
  for (const auto& [name, value] : picture.metadata) frame.header.emplace_back(name, header_value(value));
  return frame;
}

Statistics statistics_of(const render::SessionResult& r) {
  Statistics s;
  s.pixel_samples = r.samples;
  s.finished = r.outcome == render::Outcome::finished || r.outcome == render::Outcome::noise_target;
  s.seconds = r.seconds;
  s.rays = r.rays.total();
  for (const integrate::CacheState& c : r.caches)
    s.caches.push_back({c.name, c.counts.lookups, c.counts.hits, c.counts.fills,
                        c.has_memory ? c.evictions : c.counts.evictions,
                        c.has_memory ? c.bytes : uint64_t(std::max<int64_t>(c.counts.bytes, 0))});
  return s;
}

}  // namespace api

const Layer* Picture::layer(std::string_view name) const {
  const auto it = std::find_if(layers.begin(), layers.end(), [&](const Layer& l) { return l.name == name; });
  return it == layers.end() ? nullptr : &*it;
}

void Picture::write(const std::string& path) const {
  api::guarded([&] {
    if (layers.empty()) throw UsageError("the frame has no layer");
    OutputImage out;
    out.width = picture().width, out.height = picture().height;
    out.origin = V2i(origin_x, origin_y);
    out.display_width = film_width, out.display_height = film_height;
    for (const Layer& l : layers) {
      if (l.width != out.width || l.height != out.height ||
          l.pixels.size() != size_t(l.width) * size_t(l.height) * l.channels.size())
        throw UsageError("layer \"" + l.name + "\" has another size than the picture, or than it says");
      out.layers.push_back({l.name.empty() ? "rgb" : l.name, l.channels, l.pixels, {}});
    }
    for (const auto& [name, value] : header) out.metadata.emplace_back(name, metadata_value(value));
    image::ExrOptions exr;
    exr.type = image::SampleType::full_float;
    image::write_image(path, out, exr);
  });
}

Picture read(const std::string& path) {
  return api::guarded([&] {
    const Image image = image::read_image(path, FileLoc{path, 0, 0});
    Picture frame;
    frame.film_width = image.width(), frame.film_height = image.height();
    std::map<std::string, size_t> known;
    std::vector<std::vector<int>> channels;
    for (int c = 0; c < image.channels(); ++c) {
      const std::string& channel = image.channel_names()[size_t(c)];
      const auto [it, is_new] = known.emplace(layer_name(channel), frame.layers.size());
      if (is_new) {
        frame.layers.push_back({it->first, {}, image.width(), image.height(), {}});
        channels.emplace_back();
      }
      frame.layers[it->second].channels.push_back(channel);
      channels[it->second].push_back(c);
    }
    for (size_t l = 0; l < channels.size(); ++l) {
      const Image part = image.select(channels[l]);
      frame.layers[l].pixels.assign(part.pixels().begin(), part.pixels().end());
    }
    // The picture first, wherever it stands in the file.
    std::stable_partition(frame.layers.begin(), frame.layers.end(), [](const Layer& l) { return l.name.empty(); });
    return frame;
  });
}

Layer denoised(const Layer& picture, const Layer* albedo, const Layer* normal, const std::string& weights_folder) {
  return api::guarded([&] {
    if (!albedo != !normal) throw UsageError("albedo and normal go together");
    const Image colour = image_of(picture, "picture");
    const denoise::Denoiser network(
        denoise::weights_path(albedo ? denoise::feature_weights : denoise::color_weights, weights_folder));
    Image result;
    if (albedo) {
      const Image a = image_of(*albedo, "albedo"), n = image_of(*normal, "normal");
      result = network(colour, &a, &n);
    } else {
      result = network(colour, nullptr, nullptr);
    }
    Layer out = picture;
    out.pixels.assign(result.pixels().begin(), result.pixels().end());
    return out;
  });
}

void set_threads(int count) {
  api::guarded([&] {
    if (count < 0 || count > most_threads)
      throw UsageError("threads must be from 0 to " + std::to_string(most_threads) + "; got " + std::to_string(count));
    set_thread_count(count);
  });
}

std::string version() {
  return render::version();
}

}  // namespace dapple
