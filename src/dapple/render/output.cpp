// SPDX-License-Identifier: Apache-2.0
#include "dapple/render/output.h"

#include <algorithm>
#include <functional>
#include <stdexcept>

#include "dapple/base/error.h"
#include "dapple/base/parallel.h"

namespace dapple::render {

using image::ImageLayer;
using image::SampleType;
using scene::Film;

namespace {

// Collects one layer; `write` puts a pixel's numbers to `out`.
ImageLayer layer(const Film& film, const std::string& name, std::vector<std::string> channels,
                 std::optional<SampleType> type, bool loops,
                 const std::function<void(int x, int y, float* out)>& write) {
  ImageLayer l{name, std::move(channels), {}, type};
  l.pixels.resize(size_t(film.width()) * size_t(film.height()) * l.channels.size());
  const Box2i& crop = film.settings().crop;
  const auto rows = [&](size_t begin, size_t end) {
    float* out = &l.pixels[begin * size_t(film.width()) * l.channels.size()];
    for (size_t row = begin; row < end; ++row)
      for (int x = crop.min.x; x < crop.max.x; ++x, out += l.channels.size()) write(x, crop.min.y + int(row), out);
  };
  if (loops)
    parallel_ranges(size_t(film.height()), 16, rows);
  else if (film.height() > 0)
    rows(0, size_t(film.height()));
  return l;
}

void put(const RGB& c, float* out) {
  out[0] = c.r, out[1] = c.g, out[2] = c.b;
}
void put(const V3f& v, float* out) {
  out[0] = v.x, out[1] = v.y, out[2] = v.z;
}

ImageLayer layer_of(const std::string& name, std::vector<std::string> channels, const image::Image& pixels,
                    std::optional<SampleType> type = {}) {
  return {name, std::move(channels), {pixels.pixels().begin(), pixels.pixels().end()}, type};
}

/// A pixel of a film, from which the numbers of a layer come.
struct Pixel {
  const Film& film;
  const V3d& origin;  ///< OutputSettings::origin
  int x, y;

  scene::Features seen() const { return film.features(x, y); }
  scene::AirFeatures in_air() const { return film.air(x, y); }
  scene::CacheFeatures cache() const { return film.cache_features(x, y); }
};

enum class AovKind : uint8_t { features, motion, error, film, direct, air, cache };

/// A layer that --aov names.
struct Aov {
  std::string name;
  AovKind kind;
  std::vector<std::string> channels;
  std::optional<SampleType> type;                 ///< none: the picture's
  void (*write)(const Pixel& pixel, float* out);  ///< null of features, motion and error
};

const std::vector<Aov>& all_aovs() {
  using enum AovKind;
  static constexpr auto full = SampleType::full_float;
  const auto position = [](const Pixel& p, float* out) {
    const scene::Features f = p.seen();
    put(f.alpha > 0 ? V3f(V3d(f.position) + p.origin) : f.position, out);
  };
  const auto level = [](const Pixel& p, float* out) {
    const scene::CacheFeatures c = p.cache();
    out[0] = c.coarse, out[1] = c.medium, out[2] = c.fine, out[3] = c.shaded;
  };
  const auto variance = [](const Pixel& p, float* out) { put(p.film.variance(p.x, p.y), out); };
  const auto samples = [](const Pixel& p, float* out) { *out = float(p.film.samples(p.x, p.y)); };
  static const std::vector<Aov> aovs = {
      {"albedo", features, {"albedo.R", "albedo.G", "albedo.B"}, {}, nullptr},
      {"normal", features, {"normal.X", "normal.Y", "normal.Z"}, {}, nullptr},
      {"motion", motion, {"motion.X", "motion.Y", "motion.Z"}, full, nullptr},
      {"depth", film, {"Z"}, full, [](const Pixel& p, float* out) { *out = p.seen().depth; }},
      {"position", film, {"P.X", "P.Y", "P.Z"}, full, position},
      {"variance", film, {"variance.R", "variance.G", "variance.B"}, full, variance},
      {"error", AovKind::error, {"error"}, full, nullptr},
      {"samples", film, {"samples"}, full, samples},
      {"alpha", film, {"A"}, {}, [](const Pixel& p, float* out) { *out = p.seen().alpha; }},
      {"patch", film, {"patch"}, full, [](const Pixel& p, float* out) { *out = float(p.seen().grid.patch); }},
      {"grid_point", film, {"grid_point"}, full, [](const Pixel& p, float* out) { *out = float(p.seen().grid.point); }},
      {"dice_level", film, {"dice_level"}, full, [](const Pixel& p, float* out) { *out = p.seen().grid.level; }},
      {"shading_rate",
       film,
       {"shading_rate"},
       full,
       [](const Pixel& p, float* out) { *out = p.seen().grid.shading_rate; }},
      {"direct",
       AovKind::direct,
       {"direct.R", "direct.G", "direct.B"},
       {},
       [](const Pixel& p, float* out) { put(p.film.direct(p.x, p.y), out); }},
      {"airlight",
       air,
       {"airlight.R", "airlight.G", "airlight.B"},
       {},
       [](const Pixel& p, float* out) { put(p.in_air().airlight, out); }},
      {"transmittance",
       air,
       {"transmittance.R", "transmittance.G", "transmittance.B"},
       {},
       [](const Pixel& p, float* out) { put(p.in_air().transmittance, out); }},
      {"cache_level",
       cache,
       {"cache_level.coarse", "cache_level.medium", "cache_level.fine", "cache_level.shaded"},
       full,
       level},
      {"cache_age", cache, {"cache_age"}, full, [](const Pixel& p, float* out) { *out = p.cache().age; }},
      {"cache_fills", cache, {"cache_fills"}, full, [](const Pixel& p, float* out) { *out = p.cache().fills; }},
      {"cache_reuse", cache, {"cache_reuse"}, full, [](const Pixel& p, float* out) { *out = p.cache().reuse; }}};
  return aovs;
}

std::vector<std::string> names_of(std::initializer_list<AovKind> kinds) {
  std::vector<std::string> names;
  for (const Aov& aov : all_aovs())
    if (std::find(kinds.begin(), kinds.end(), aov.kind) != kinds.end()) names.push_back(aov.name);
  return names;
}

ImageLayer aov_layer(const Film& film, const std::string& name, const OutputSettings& settings) {
  const auto& aovs = all_aovs();
  const auto aov = std::find_if(aovs.begin(), aovs.end(), [&](const Aov& a) { return a.name == name; });
  if (aov == aovs.end()) throw std::logic_error("there is no AOV \"" + name + "\"");
  if (aov->kind == AovKind::features) {
    if (!settings.features) throw std::logic_error("AOVs albedo and normal need OutputSettings::features");
    return layer_of(name, aov->channels, name == "albedo" ? settings.features->albedo : settings.features->normal);
  }
  if (aov->kind == AovKind::motion) {
    if (!settings.motion) throw std::logic_error("AOV motion needs OutputSettings::motion");
    return layer_of(name, aov->channels, *settings.motion, aov->type);
  }
  if (aov->kind == AovKind::error) {
    if (!settings.error) throw std::logic_error("AOV error needs OutputSettings::error");
    return layer_of(name, aov->channels, *settings.error, aov->type);
  }
  return layer(film, name, aov->channels, aov->type, settings.loops, [&](int x, int y, float* out) {
    aov->write({film, settings.origin, x, y}, out);
  });
}

/// Leaves out all but the pixels of `window`.
void cut(const Box2i& window, image::OutputImage* out) {
  const int width = window.max.x - window.min.x, height = window.max.y - window.min.y;
  const V2i corner = window.min - out->origin;
  for (ImageLayer& l : out->layers) {
    const size_t n = l.channels.size();
    std::vector<float> pixels;
    pixels.reserve(size_t(width) * size_t(height) * n);
    for (int y = 0; y < height; ++y) {
      const float* row = &l.pixels[(size_t(y + corner.y) * size_t(out->width) + size_t(corner.x)) * n];
      pixels.insert(pixels.end(), row, row + size_t(width) * n);
    }
    l.pixels = std::move(pixels);
  }
  out->origin = window.min, out->width = width, out->height = height;
}

}  // namespace

const std::vector<std::string>& aov_names() {
  static const std::vector<std::string> names = names_of({AovKind::features, AovKind::film});
  return names;
}

const std::vector<std::string>& cache_aov_names() {
  static const std::vector<std::string> names = names_of({AovKind::cache});
  return names;
}

const std::vector<std::string>& air_aov_names() {
  static const std::vector<std::string> names = names_of({AovKind::air});
  return names;
}

bool show_direct(const std::vector<std::string>& aovs) {
  return std::find(aovs.begin(), aovs.end(), "direct") != aovs.end();
}

bool show_error(const std::vector<std::string>& aovs) {
  return std::find(aovs.begin(), aovs.end(), "error") != aovs.end();
}

bool show_motion(const std::vector<std::string>& aovs) {
  return std::find(aovs.begin(), aovs.end(), "motion") != aovs.end();
}

bool from_film(const std::string& aov) {
  return aov != "albedo" && aov != "normal" && aov != "motion" && aov != "direct" && aov != "error";
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
  known.insert(known.end(), {"motion", "direct", "error"});
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
    return layer(film, name, std::move(channels), {}, settings.loops, [&](int x, int y, float* p) {
      put(settings.cache_view ? cache_color(*settings.cache_view, film.cache_features(x, y)) : film.pixel(x, y), p);
    });
  };
  if (settings.denoised) {
    out.layers.push_back(layer_of("rgb", {"R", "G", "B"}, settings.denoised->colour));
    out.layers.push_back(rendered("noisy", {"noisy.R", "noisy.G", "noisy.B"}));
  } else {
    out.layers.push_back(rendered("rgb", {"R", "G", "B"}));
  }
  for (const std::string& name : settings.aovs) {
    out.layers.push_back(aov_layer(film, name, settings));
    if (name == "motion" && settings.motion_back)
      out.layers.push_back(layer_of("motion_back", {"motion_back.X", "motion_back.Y", "motion_back.Z"},
                                    *settings.motion_back, SampleType::full_float));
  }
  for (size_t g = 0; g < settings.light_groups.size(); ++g) {
    const std::string name = "light." + settings.light_groups[g];
    std::vector<std::string> channels{name + ".R", name + ".G", name + ".B"};
    out.layers.push_back(settings.denoised
                             ? layer_of(name, channels, settings.denoised->light_groups[g])
                             : layer(film, name, channels, {}, settings.loops,
                                     [&](int x, int y, float* p) { put(film.light_group(x, y, int(g)), p); }));
  }
  if (settings.window) cut(*settings.window, &out);
  return out;
}

}  // namespace dapple::render
