// SPDX-License-Identifier: Apache-2.0
#include "dapple/image/image_writer.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <memory>
#include <set>

#include "dapple/image/display_view.h"
#include "dapple/image/image_output.h"
#include "dapple/image/pixel_writer.h"

namespace dapple::image {

namespace {

constexpr float largest_half = 65504;

OIIO::TypeDesc oiio_type(SampleType t) {
  return t == SampleType::half_float ? OIIO::TypeDesc::HALF : OIIO::TypeDesc::FLOAT;
}

void check_picture(const OutputImage& image) {
  const auto refuse = [](const std::string& why) { throw UsageError("cannot write the image: " + why); };
  if (image.width < 1 || image.height < 1) refuse("it has no pixels");
  if (image.layers.empty()) refuse("it has no layers");
  std::set<std::string> names;
  const size_t pixels = static_cast<size_t>(image.width) * static_cast<size_t>(image.height);
  for (const ImageLayer& layer : image.layers) {
    if (layer.channels.empty()) refuse("layer \"" + layer.name + "\" has no channels");
    if (layer.pixels.size() != pixels * layer.channels.size())
      refuse("layer \"" + layer.name + "\" holds " + std::to_string(layer.pixels.size()) + " numbers; expected " +
             std::to_string(pixels * layer.channels.size()));
    for (const std::string& c : layer.channels)
      if (!names.insert(c).second) refuse("channel \"" + c + "\" occurs twice");
  }
}

void add_metadata(OIIO::ImageSpec& spec, const OutputImage& image) {
  for (const auto& [name, value] : image.metadata) {
    if (const auto* s = std::get_if<std::string>(&value)) spec.attribute(name, *s);
    if (const auto* i = std::get_if<int>(&value)) spec.attribute(name, *i);
    if (const auto* f = std::get_if<float>(&value)) spec.attribute(name, *f);
    if (const auto* m = std::get_if<M44f>(&value)) spec.attribute(name, OIIO::TypeMatrix, &m->x[0][0]);
  }
}

/// Windows and metadata of a file or part that holds `layers`.
OIIO::ImageSpec exr_spec(const OutputImage& image, std::span<const ImageLayer* const> layers,
                         const ExrOptions& options) {
  OIIO::ImageSpec spec(image.width, image.height, 0, oiio_type(options.type));
  for (const ImageLayer* layer : layers)
    for (const std::string& channel : layer->channels) {
      spec.channelnames.push_back(channel);
      spec.channelformats.push_back(oiio_type(layer->type.value_or(options.type)));
      if (channel == "A") spec.alpha_channel = spec.nchannels;
      if (channel == "Z") spec.z_channel = spec.nchannels;
      ++spec.nchannels;
    }
  spec.x = image.origin.x;
  spec.y = image.origin.y;
  spec.full_width = image.display_width > 0 ? image.display_width : image.width;
  spec.full_height = image.display_height > 0 ? image.display_height : image.height;
  if (image.display_width <= 0) spec.full_x = spec.x;
  if (image.display_height <= 0) spec.full_y = spec.y;
  if (options.tile_size > 0) spec.tile_width = spec.tile_height = options.tile_size;
  add_metadata(spec, image);
  spec.attribute("compression", options.compression);
  spec.attribute("PixelAspectRatio", image.pixel_aspect);
  // Keeps the writer from inventing a date, which would make every file different.
  if (!spec.find_attribute("DateTime")) spec.attribute("DateTime", "");
  if (layers.size() == 1 && options.multi_part) spec.attribute("oiio:subimagename", layers[0]->name);
  return spec;
}

/// Channels of several layers side by side, those written as half kept within its range.
std::vector<float> interleave(const OutputImage& image, std::span<const ImageLayer* const> layers,
                              const OIIO::ImageSpec& spec) {
  const size_t pixels = static_cast<size_t>(image.width) * static_cast<size_t>(image.height);
  const size_t stride = static_cast<size_t>(spec.nchannels);
  std::vector<float> out(pixels * stride);
  size_t offset = 0;
  for (const ImageLayer* layer : layers) {
    const size_t n = layer->channels.size();
    const float limit = spec.channelformats[offset] == OIIO::TypeDesc::HALF ? largest_half : infinity;
    for (size_t i = 0; i < pixels; ++i)
      for (size_t c = 0; c < n; ++c) {
        const float v = layer->pixels[i * n + c];
        out[i * stride + offset + c] = std::isnan(v) ? v : std::clamp(v, -limit, limit);
      }
    offset += n;
  }
  return out;
}

using LayerGroup = std::vector<const ImageLayer*>;

std::vector<LayerGroup> group_layers(const OutputImage& image, bool multi_part) {
  std::vector<LayerGroup> groups;
  for (const ImageLayer& layer : image.layers) {
    if (groups.empty() || multi_part) groups.emplace_back();
    groups.back().push_back(&layer);
  }
  return groups;
}

void check_extension(const std::string& path) {
  if (!is_image_extension(extension_of(path)))
    throw UsageError("cannot tell the kind of image from the name \"" + path + "\"; " +
                     one_of({".exr", ".png", ".jpg", ".tif", ".hdr"}));
}

bool is_jpeg(const std::string& extension) {
  return extension == "jpg" || extension == "jpeg";
}
bool is_tiff(const std::string& extension) {
  return extension == "tif" || extension == "tiff";
}

}  // namespace

std::string extension_of(const std::string& path) {
  const size_t slash = path.find_last_of('/'), dot = path.find_last_of('.');
  if (dot == std::string::npos || (slash != std::string::npos && dot < slash)) return {};
  std::string e = path.substr(dot + 1);
  for (char& c : e) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return e;
}

void check_compression(const std::string& name) {
  static const std::vector<std::string_view> compressions{"none",  "rle", "zip",  "zips", "piz",
                                                          "pxr24", "b44", "b44a", "dwaa", "dwab"};
  if (std::find(compressions.begin(), compressions.end(), name) == compressions.end())
    throw UsageError("unknown compression \"" + name + "\", " + one_of(compressions));
}

void write_exr(const std::string& path, const OutputImage& image, const ExrOptions& options) {
  check_picture(image);
  check_compression(options.compression);

  const std::vector<LayerGroup> groups = group_layers(image, options.multi_part);
  std::vector<OIIO::ImageSpec> specs;
  for (const LayerGroup& g : groups) specs.push_back(exr_spec(image, g, options));
  write_atomically(path, "openexr", [&](OIIO::ImageOutput& out, const std::string& part) {
    const bool opened =
        specs.size() == 1 ? out.open(part, specs[0]) : out.open(part, static_cast<int>(specs.size()), specs.data());
    if (!opened) return false;
    for (size_t i = 0; i < groups.size(); ++i) {
      if (i > 0 && !out.open(part, specs[i], OIIO::ImageOutput::AppendSubimage)) return false;
      const std::vector<float> pixels = interleave(image, groups[i], specs[i]);
      if (!write_pixels(out, OIIO::TypeDesc::FLOAT, pixels.data())) return false;
    }
    return true;
  });
}

void write_png(const std::string& path, const OutputImage& image, const PngOptions& options) {
  check_picture(image);
  if (options.bits != 8 && options.bits != 16) throw UsageError("PNG images have 8 or 16 bits a sample");
  const Image encoded = apply_view(image, options.view);
  const OIIO::TypeDesc type = options.bits == 8 ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::UINT16;
  OIIO::ImageSpec spec(encoded.width(), encoded.height(), encoded.channels(), type);
  spec.attribute("oiio:UnassociatedAlpha", 1);
  add_metadata(spec, image);
  write_atomically(path, "png", [&](OIIO::ImageOutput& out, const std::string& part) {
    return out.open(part, spec) && out.write_image(OIIO::TypeDesc::FLOAT, encoded.pixels().data());
  });
}

void write_jpeg(const std::string& path, const OutputImage& image, const DisplayView& view) {
  check_picture(image);
  check_size(path, image.width, image.height);
  Image encoded = apply_view(image, view);
  if (encoded.channels() == 4) encoded = encoded.select(std::array{0, 1, 2});
  if (encoded.channels() == 2) encoded = encoded.select(std::array{0});
  OIIO::ImageSpec spec(encoded.width(), encoded.height(), encoded.channels(), OIIO::TypeDesc::UINT8);
  add_metadata(spec, image);
  spec.attribute("Compression", "jpeg:95");
  write_atomically(path, "jpeg", [&](OIIO::ImageOutput& out, const std::string& part) {
    return out.open(part, spec) && out.write_image(OIIO::TypeDesc::FLOAT, encoded.pixels().data());
  });
}

void write_linear(const std::string& path, const OutputImage& image, const char* format) {
  check_picture(image);
  Image plain = first_layer(image);
  const bool is_hdr = std::string_view(format) == "hdr";
  if (is_hdr && plain.channels() == 4) plain = plain.select(std::array{0, 1, 2});
  if (is_hdr && plain.channels() < 3) plain = plain.select(std::array{0, 0, 0});
  OIIO::ImageSpec spec(plain.width(), plain.height(), plain.channels(), OIIO::TypeDesc::FLOAT);
  add_metadata(spec, image);
  spec.attribute("oiio:ColorSpace", "Linear");
  if (!is_hdr) spec.attribute("compression", "zip");
  write_atomically(path, format, [&](OIIO::ImageOutput& out, const std::string& part) {
    return out.open(part, spec) && out.write_image(OIIO::TypeDesc::FLOAT, plain.pixels().data());
  });
}

// libjpeg ends the program for what is larger.
void check_size(const std::string& path, int width, int height) {
  constexpr int most_jpeg = 65500;
  if (is_jpeg(extension_of(path)) && std::max(width, height) > most_jpeg)
    throw UsageError("cannot write \"" + path + "\": JPEG images have at most " + std::to_string(most_jpeg) +
                     " pixels a side; the image has " + std::to_string(width) + " x " + std::to_string(height));
}

bool is_for_display(const std::string& extension) {
  return extension == "png" || is_jpeg(extension);
}

bool is_image_extension(const std::string& extension) {
  return extension == "exr" || extension == "hdr" || is_for_display(extension) || is_tiff(extension);
}

void write_image(const std::string& path, const OutputImage& image, const ExrOptions& exr, const PngOptions& png) {
  check_extension(path);
  const std::string extension = extension_of(path);
  if (extension == "exr")
    write_exr(path, image, exr);
  else if (extension == "png")
    write_png(path, image, png);
  else if (is_jpeg(extension))
    write_jpeg(path, image, png.view);
  else
    write_linear(path, image, extension == "hdr" ? "hdr" : "tiff");
}

void check_writable(const std::string& path) {
  check_extension(path);
  check_output_path(path);
}

}  // namespace dapple::image
