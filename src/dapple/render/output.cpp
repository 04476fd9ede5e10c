// SPDX-License-Identifier: Apache-2.0
#include "dapple/render/output.h"

#include <algorithm>
#include <functional>
#include <stdexcept>

#include "dapple/base/error.h"

namespace dapple::render {

using image::ImageLayer;
using image::SampleType;
using scene::Film;

namespace {

// Collects one layer; `write` puts a pixel's numbers to `out`.
ImageLayer layer(const Film& film, const std::string& name, std::vector<std::string> channels,
                 std::optional<SampleType> type, const std::function<void(int x, int y, float* out)>& write) {
  ImageLayer l{name, std::move(channels), {}, type};
  l.pixels.resize(size_t(film.width()) * size_t(film.height()) * l.channels.size());
  float* out = l.pixels.data();
  const Box2i& crop = film.settings().crop;
  for (int y = crop.min.y; y < crop.max.y; ++y)
    for (int x = crop.min.x; x < crop.max.x; ++x, out += l.channels.size()) write(x, y, out);
  return l;
}

void put(const RGB& c, float* out) {
  out[0] = c.r, out[1] = c.g, out[2] = c.b;
}
void put(const V3f& v, float* out) {
  out[0] = v.x, out[1] = v.y, out[2] = v.z;
}

ImageLayer layer_of(const std::string& name, std::vector<std::string> channels, const image::Image& pixels) {
  return {name, std::move(channels), {pixels.pixels().begin(), pixels.pixels().end()}, {}};
}

ImageLayer aov_layer(const Film& film, const std::string& name, const OutputSettings& settings) {
  const auto full = SampleType::full_float;
  const V3d& origin = settings.origin;
  if ((name == "albedo" || name == "normal") && !settings.features)
    throw std::logic_error("AOVs albedo and normal need OutputSettings::features");
  if (name == "albedo") return layer_of(name, {"albedo.R", "albedo.G", "albedo.B"}, settings.features->albedo);
  if (name == "normal") return layer_of(name, {"normal.X", "normal.Y", "normal.Z"}, settings.features->normal);
  if (name == "depth")
    return layer(film, name, {"Z"}, full, [&](int x, int y, float* out) { *out = film.features(x, y).depth; });
  if (name == "position")
    return layer(film, name, {"P.X", "P.Y", "P.Z"}, full, [&](int x, int y, float* out) {
      const scene::Features f = film.features(x, y);
      put(f.alpha > 0 ? V3f(V3d(f.position) + origin) : f.position, out);
    });
  if (name == "variance")
    return layer(film, name, {"variance.R", "variance.G", "variance.B"}, full,
                 [&](int x, int y, float* out) { put(film.variance(x, y), out); });
  if (name == "patch")
    return layer(film, name, {"patch"}, full,
                 [&](int x, int y, float* out) { *out = float(film.features(x, y).grid.patch); });
  if (name == "grid_point")
    return layer(film, name, {"grid_point"}, full,
                 [&](int x, int y, float* out) { *out = float(film.features(x, y).grid.point); });
  if (name == "dice_level")
    return layer(film, name, {"dice_level"}, full,
                 [&](int x, int y, float* out) { *out = film.features(x, y).grid.level; });
  if (name == "shading_rate")
    return layer(film, name, {"shading_rate"}, full,
                 [&](int x, int y, float* out) { *out = film.features(x, y).grid.shading_rate; });
  if (name == "cache_level")
    return layer(film, name, {"cache_level.coarse", "cache_level.medium", "cache_level.fine", "cache_level.shaded"},
                 full, [&](int x, int y, float* out) {
                   const scene::CacheUse use = film.cache_use(x, y);
                   out[0] = use.coarse, out[1] = use.medium, out[2] = use.fine, out[3] = use.shaded;
                 });
  if (name == "cache_age")
    return layer(film, name, {"cache_age"}, full, [&](int x, int y, float* out) { *out = film.cache_use(x, y).age; });
  if (name == "cache_fills")
    return layer(film, name, {"cache_fills"}, full,
                 [&](int x, int y, float* out) { *out = film.cache_use(x, y).fills; });
  if (name == "cache_reuse")
    return layer(film, name, {"cache_reuse"}, full,
                 [&](int x, int y, float* out) { *out = film.cache_use(x, y).reuse; });
  if (name == "airlight")
    return layer(film, name, {"airlight.R", "airlight.G", "airlight.B"}, {},
                 [&](int x, int y, float* out) { put(film.air(x, y).airlight, out); });
  if (name == "transmittance")
    return layer(film, name, {"transmittance.R", "transmittance.G", "transmittance.B"}, {},
                 [&](int x, int y, float* out) { put(film.air(x, y).transmittance, out); });
  if (name == "samples")
    return layer(film, name, {"samples"}, full, [&](int x, int y, float* out) { *out = float(film.samples(x, y)); });
  return layer(film, name, {"A"}, {}, [&](int x, int y, float* out) { *out = film.features(x, y).alpha; });
}

}  // namespace

const std::vector<std::string>& aov_names() {
  static const std::vector<std::string> names = {"albedo",     "normal",     "depth",       "position",
                                                 "variance",   "samples",    "alpha",       "patch",
                                                 "grid_point", "dice_level", "shading_rate"};
  return names;
}

const std::vector<std::string>& cache_aov_names() {
  static const std::vector<std::string> names = {"cache_level", "cache_age", "cache_fills", "cache_reuse"};
  return names;
}

const std::vector<std::string>& air_aov_names() {
  static const std::vector<std::string> names = {"airlight", "transmittance"};
  return names;
}

bool show_air(const std::vector<std::string>& aovs) {
  const auto& names = air_aov_names();
  return std::find_first_of(aovs.begin(), aovs.end(), names.begin(), names.end()) != aovs.end();
}

bool show_cache_use(const std::vector<std::string>& aovs) {
  const auto& names = cache_aov_names();
  return std::find_first_of(aovs.begin(), aovs.end(), names.begin(), names.end()) != aovs.end();
}

std::vector<std::string> parse_aovs(const std::string& list) {
  std::vector<std::string> known = aov_names(), chosen;
  known.insert(known.end(), air_aov_names().begin(), air_aov_names().end());
  known.insert(known.end(), cache_aov_names().begin(), cache_aov_names().end());
  for (size_t begin = 0; begin < list.size();) {
    const size_t end = std::min(list.find(',', begin), list.size());
    const std::string name = list.substr(begin, end - begin);
    begin = end + 1;
    if (name == "all") return aov_names();
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      std::vector<std::string_view> legal(known.begin(), known.end());
      legal.push_back("all");
      throw UsageError("--aov: \"" + name + "\" is unknown; " + one_of(legal));
    }
    if (std::find(chosen.begin(), chosen.end(), name) == chosen.end()) chosen.push_back(name);
  }
  return chosen;
}

image::OutputImage make_output(const Film& film, const OutputSettings& settings) {
  const Film::Settings& f = film.settings();
  image::OutputImage out;
  out.width = film.width();
  out.height = film.height();
  out.origin = f.crop.min;
  out.display_width = f.resolution.x;
  out.display_height = f.resolution.y;
  out.metadata = settings.metadata;
  const auto rendered = [&](const std::string& name, std::vector<std::string> channels) {
    return layer(film, name, std::move(channels), {}, [&](int x, int y, float* p) {
      put(settings.cache_view ? cache_color(*settings.cache_view, film.cache_use(x, y)) : film.pixel(x, y), p);
    });
  };
  if (settings.denoised) {
    out.layers.push_back(layer_of("rgb", {"R", "G", "B"}, settings.denoised->colour));
    out.layers.push_back(rendered("noisy", {"noisy.R", "noisy.G", "noisy.B"}));
  } else {
    out.layers.push_back(rendered("rgb", {"R", "G", "B"}));
  }
  for (const std::string& name : settings.aovs) out.layers.push_back(aov_layer(film, name, settings));
  for (size_t g = 0; g < settings.light_groups.size(); ++g) {
    const std::string name = "light." + settings.light_groups[g];
    std::vector<std::string> channels{name + ".R", name + ".G", name + ".B"};
    out.layers.push_back(settings.denoised ? layer_of(name, channels, settings.denoised->light_groups[g])
                                           : layer(film, name, channels, {}, [&](int x, int y, float* p) {
                                               put(film.light_group(x, y, int(g)), p);
                                             }));
  }
  return out;
}

void write_output(const std::string& path, const Film& film, const OutputSettings& settings) {
  image::write_image(path, make_output(film, settings), settings.exr, settings.png);
}

}  // namespace dapple::render
