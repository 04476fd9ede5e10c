// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/model_pictures.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "dapple/image/image_writer.h"

namespace dapple::modelfile {

namespace fs = std::filesystem;

namespace {

int hex(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  c = char(std::tolower(static_cast<unsigned char>(c)));
  return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

// URIs have spaces as %20.
std::string decoded(const std::string& text) {
  std::string out;
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && i + 2 < text.size() && hex(text[i + 1]) >= 0 && hex(text[i + 2]) >= 0) {
      out += char(hex(text[i + 1]) * 16 + hex(text[i + 2]));
      i += 2;
    } else {
      out += text[i];
    }
  }
  return out;
}

std::string lower(std::string s) {
  std::transform(s.begin(), s.end(), s.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return s;
}

bool is_file(const fs::path& p) {
  std::error_code ignored;
  return fs::is_regular_file(p, ignored);
}

// The file of this name in a folder, in whatever case it is written there.
std::string in_any_case(const fs::path& folder, const std::string& name) {
  std::error_code ignored;
  std::vector<std::string> found;
  for (fs::directory_iterator it(folder, ignored), end; it != end; it.increment(ignored)) {
    if (ignored) break;
    if (lower(it->path().filename().string()) == name && is_file(it->path())) found.push_back(it->path().string());
  }
  return found.empty() ? "" : *std::min_element(found.begin(), found.end());
}

std::string safe_name(const std::string& text) {
  std::string out;
  for (const char c : text.substr(0, 60)) out += std::isalnum(static_cast<unsigned char>(c)) || c == '-' ? c : '_';
  return out;
}

}  // namespace

ModelPictures::ModelPictures(const Model& model, const std::string& model_path, const FileLoc& loc,
                             Diagnostics* diagnostics)
    : model_(model), loc_(loc), diagnostics_(*diagnostics) {
  std::error_code ignored;
  directory_ = fs::absolute(fs::path(model_path), ignored).parent_path().string();
}

image::TemporaryFolder& ModelPictures::temporary() {
  if (!folder_) folder_ = std::make_shared<image::TemporaryFolder>("");
  return *folder_;
}

// As named; else, since models are moved without their folders, by its name in the folders where pictures use to be.
std::string ModelPictures::find(const std::string& name) const {
  for (const std::string& text : {name, decoded(name)}) {
    std::string plain = text;
    std::replace(plain.begin(), plain.end(), '\\', '/');
    if (plain.starts_with("file://")) plain.erase(0, 7);
    if (const fs::path p = fs::path(directory_) / plain; is_file(p)) return p.lexically_normal().string();
    const std::string base = lower(fs::path(plain).filename().string());
    if (base.empty()) continue;
    const std::string folder = fs::path(plain).parent_path().filename().string();
    for (const std::string& at : {std::string(), folder, std::string("textures"), std::string("Textures"),
                                  std::string("maps"), std::string("images"), std::string("../textures")})
      if (const std::string file = in_any_case(fs::path(directory_) / at, base); !file.empty())
        return fs::path(file).lexically_normal().string();
  }
  return "";
}

// Raw texels as an uncompressed Targa file, which keeps them as they are.
std::string ModelPictures::write_image(size_t index) {
  const ModelImage& image = model_.images[index];
  const bool raw = image.width > 0;
  const std::string extension = raw ? "tga" : safe_name(image.extension.empty() ? "img" : image.extension);
  const std::string stem = safe_name(fs::path(image.name).stem().string());
  const std::string path = temporary().file(std::to_string(index) + (stem.empty() ? "" : "-" + stem) + "." + extension);
  std::ofstream out(path, std::ios::binary);
  if (!raw) {
    out.write(reinterpret_cast<const char*>(image.bytes.data()), std::streamsize(image.bytes.size()));
  } else {
    if (image.width > 65535 || image.height > 65535) return "";
    const auto byte = [](uint32_t x) { return char(x & 255u); };
    const char header[18] = {0,
                             0,
                             2,
                             0,
                             0,
                             0,
                             0,
                             0,
                             0,
                             0,
                             0,
                             0,
                             byte(image.width),
                             byte(image.width >> 8),
                             byte(image.height),
                             byte(image.height >> 8),
                             32,
                             0x28};
    out.write(header, sizeof header);
    std::string texels(image.bytes.begin(), image.bytes.end());
    for (size_t i = 0; i + 3 < texels.size(); i += 4) std::swap(texels[i], texels[i + 2]);
    out.write(texels.data(), std::streamsize(texels.size()));
  }
  out.close();
  if (!out) throw IoError("cannot write the pictures of a model to \"" + path + "\"");
  return path;
}

std::optional<std::string> ModelPictures::path(const ModelTexture& texture) {
  if (!texture.given()) return std::nullopt;
  const std::string key = texture.image >= 0 ? "*" + std::to_string(texture.image) : texture.file;
  const auto known = found_.find(key);
  if (known != found_.end()) return known->second;
  std::optional<std::string> result;
  const std::string name = texture.image >= 0 ? "picture " + std::to_string(texture.image) + " inside of the model"
                                              : "picture \"" + texture.file.substr(0, 200) + "\"";
  const std::string file = texture.image >= 0 ? write_image(size_t(texture.image)) : find(texture.file);
  if (file.empty()) {
    diagnostics_.warn(loc_, name + " is not there: the material is rendered without it", key);
  } else {
    try {
      image::read_image_info(file, loc_);
      result = file;
    } catch (const InputError& error) {
      std::string why = error.what();
      const std::string place = loc_.to_string() + ": ";
      if (why.starts_with(place)) why.erase(0, place.size());
      diagnostics_.warn(loc_, name + " cannot be read (" + why + "): the material is rendered without it", key);
    }
  }
  found_[key] = result;
  return result;
}

bool ModelPictures::has_alpha(const std::string& path) {
  const auto known = alphas_.find(path);
  if (known != alphas_.end()) return known->second;
  bool result = false;
  if (image::read_image_info(path, loc_).has_alpha()) {
    const image::Image image = image::read_image(path, loc_);
    const int channel = image.alpha_channel();
    for (int y = 0; channel >= 0 && y < image.height() && !result; ++y)
      for (int x = 0; x < image.width() && !result; ++x) result = image.pixel(x, y)[channel] < 1;
  }
  return alphas_[path] = result;
}

bool ModelPictures::is_normal_map(const std::string& path) {
  const image::Image image = image::read_image(path, loc_, image::Encoding::linear());
  RGB sum(0);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) sum += image.rgb(x, y);
  const RGB mean = sum / float(std::max(1, image.width() * image.height()));
  return mean.b > 0.7f && std::abs(mean.r - 0.5f) < 0.15f && std::abs(mean.g - 0.5f) < 0.15f;
}

namespace {

// Cells of 2 x 2 texels, one a triangle, in rows.
struct CornerGrid {
  explicit CornerGrid(size_t triangles)
      : across(std::max(1, int(std::ceil(std::sqrt(double(triangles)))))),
        down(std::max(1, int((triangles + size_t(across) - 1) / size_t(across)))) {}
  V2i corner(size_t t) const { return V2i(2 * int(t % size_t(across)), 2 * int(t / size_t(across))); }
  int across, down;
};

}  // namespace

std::vector<V2f> ModelPictures::corner_places(size_t triangles) {
  const CornerGrid grid(triangles);
  const double w = 2.0 * grid.across, h = 2.0 * grid.down;
  std::vector<V2f> places;
  places.reserve(triangles * 3);
  const auto add = [&](int x, int y) { places.push_back({float((x + 0.5) / w), float(1 - (y + 0.5) / h)}); };
  for (size_t t = 0; t < triangles; ++t) {
    const V2i c = grid.corner(t);
    add(c.x, c.y), add(c.x + 1, c.y), add(c.x, c.y + 1);
  }
  return places;
}

std::string ModelPictures::write_corner_colors(const ModelMesh& mesh) {
  const size_t triangles = mesh.indices.size() / 3;
  const CornerGrid grid(triangles);
  image::OutputImage out;
  out.width = 2 * grid.across, out.height = 2 * grid.down;
  image::ImageLayer layer{"rgb", {"R", "G", "B"}, {}, image::SampleType::full_float};
  layer.pixels.resize(size_t(out.width) * size_t(out.height) * 3);
  const auto put = [&](int x, int y, const RGB& c) {
    float* const p = &layer.pixels[(size_t(y) * size_t(out.width) + size_t(x)) * 3];
    p[0] = c.r, p[1] = c.g, p[2] = c.b;
  };
  for (size_t t = 0; t < triangles; ++t) {
    RGB c[3];
    for (size_t k = 0; k < 3; ++k) c[k] = mesh.color[size_t(mesh.indices[3 * t + k])];
    const V2i at = grid.corner(t);
    put(at.x, at.y, c[0]), put(at.x + 1, at.y, c[1]), put(at.x, at.y + 1, c[2]);
    put(at.x + 1, at.y + 1, c[1] + c[2] - c[0]);  // bilinear is linear then
  }
  out.layers.push_back(std::move(layer));
  const std::string path = temporary().file("corners-" + std::to_string(corner_pictures_++) + ".exr");
  image::write_exr(path, out);
  return path;
}

}  // namespace dapple::modelfile
