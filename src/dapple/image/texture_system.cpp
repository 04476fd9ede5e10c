// SPDX-License-Identifier: Apache-2.0
#include "dapple/image/texture_system.h"

#include <OpenImageIO/texture.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <tuple>

#include "dapple/image/mip_pyramid.h"
#include "dapple/image/temporary_folder.h"
#include "dapple/image/texel_lattice.h"
#include "dapple/image/texture_source.h"

namespace dapple::image {

namespace {

constexpr size_t resident_limit = size_t{1} << 20;    // samples of one image
constexpr size_t resident_total = size_t{256} << 20;  // bytes of all
constexpr float widest_footprint = 1e4f;              // texture widths; beyond lies only the mean

struct Destroy {
  void operator()(OIIO::TextureSystem* s) const { OIIO::TextureSystem::destroy(s); }
};

OIIO::TextureOpt::Wrap oiio_wrap(Wrap w) {
  switch (w) {
    case Wrap::black:
      return OIIO::TextureOpt::WrapBlack;
    case Wrap::clamp:
      return OIIO::TextureOpt::WrapClamp;
    case Wrap::repeat:
      break;
  }
  return OIIO::TextureOpt::WrapPeriodic;
}

OIIO::TextureOpt oiio_options(const TextureSampling& sampling) {
  OIIO::TextureOpt o;
  o.swrap = o.twrap = oiio_wrap(sampling.wrap);
  o.interpmode =
      sampling.filter == TextureFilter::point ? OIIO::TextureOpt::InterpClosest : OIIO::TextureOpt::InterpBilinear;
  switch (sampling.filter) {
    case TextureFilter::point:
    case TextureFilter::bilinear:
      o.mipmode = OIIO::TextureOpt::MipModeOneLevel;
      break;
    case TextureFilter::trilinear:
      o.mipmode = OIIO::TextureOpt::MipModeTrilinear;
      break;
    case TextureFilter::ewa:
      o.mipmode = OIIO::TextureOpt::MipModeAniso;
      break;
  }
  o.anisotropic = static_cast<int>(std::lround(std::clamp(sampling.max_anisotropy, 1.0f, 64.0f)));
  return o;
}

float sane_derivative(float v) {
  return std::isnan(v) ? 0.0f : std::clamp(v, -widest_footprint, widest_footprint);
}

/// A point and footprint with t downwards, as files are stored: the one place where the axis turns round.
struct Probe {
  float s, t, dsdx = 0, dtdx = 0, dsdy = 0, dtdy = 0;

  Probe(const TextureCoordinates& at, int i, Wrap wrap)
      : s(sane_coordinate(at.s[i], wrap)), t(sane_coordinate(1 - at.t[i], wrap)) {
    if (!at.dsdx) return;
    dsdx = sane_derivative(at.dsdx[i]);
    dsdy = sane_derivative(at.dsdy[i]);
    dtdx = -sane_derivative(at.dtdx[i]);
    dtdy = -sane_derivative(at.dtdy[i]);
  }
  bool within_a_texel(int width, int height) const {
    return std::max(std::abs(dsdx), std::abs(dsdy)) * static_cast<float>(width) <= 1 &&
           std::max(std::abs(dtdx), std::abs(dtdy)) * static_cast<float>(height) <= 1;
  }
};

void look_up_resident(const Image& image, const Probe& p, const TextureSampling& sampling, float* out) {
  const TexelLattice lattice{image.width(), image.height(), sampling.wrap, sampling.filter};
  const TexelLattice::Corners at = lattice.corners(p.s, p.t);
  std::fill_n(out, image.channels(), 0.0f);
  for (int k = 0; k < at.count; ++k) {
    if (at.x[k] < 0 || at.y[k] < 0) continue;
    const float* texel = image.pixel(at.x[k], at.y[k]);
    for (int c = 0; c < image.channels(); ++c) out[c] += at.weight[k] * texel[c];
  }
}

/// Writes `to` channels at out from `from` channels of a look-up.
void store(const float* value, int from, int to, float* out) {
  if (from == to)
    std::copy_n(value, to, out);
  else if (from == 1)
    out[0] = out[1] = out[2] = value[0];
  else
    out[0] = (value[0] + value[1] + value[2]) / 3;
}

void divide_by_weight(int channels, float* value) {
  const float weight = value[channels], scale = weight > 0 ? 1 / weight : 0;
  for (int c = 0; c < channels; ++c) value[c] *= scale;
}

/// How much the texels of a picture count in which another is cut out.
std::vector<float> weights_of_picture(const TextureWeight& weight, const Image& image, const FileLoc& loc) {
  const Image picture = select_channels(read_image(weight.path, loc, weight.encoding), TextureUse::scalar);
  if (picture.width() != image.width() || picture.height() != image.height())
    throw InputError(loc, "picture \"" + weight.path + "\" has another size than the one that it is to weight");
  std::vector<float> weights(picture.pixels().begin(), picture.pixels().end());
  for (float& w : weights) {
    w = weight.scale * (weight.invert ? 1 - w : w);
    w = w > 0 ? std::min(w, 1.0f) : 0;
  }
  return weights;
}

/// How much each texel of a colour image counts: its own alpha, times the picture's. None where all count the same, or
/// nothing would.
std::vector<float> weights_of(const Image& image, const TextureWeight& weight, const FileLoc& loc) {
  if (weight.by == TextureWeight::By::nothing) return {};
  std::vector<float> own = alpha_weights(image);
  const auto of_use = [](const std::vector<float>& w) {
    return std::any_of(w.begin(), w.end(), [&w](float v) { return v != w[0]; });
  };
  if (weight.by == TextureWeight::By::picture) {
    std::vector<float> both = weights_of_picture(weight, image, loc);
    if (!own.empty()) std::transform(own.begin(), own.end(), both.begin(), both.begin(), std::multiplies());
    if (of_use(both)) return both;
  }
  return of_use(own) ? own : std::vector<float>();
}

}  // namespace

struct TextureSystem::Shared {
  using Key = std::tuple<std::string, Encoding::Kind, float, TextureUse, TextureWeight::By, std::string, Encoding::Kind,
                         float, float, bool>;

  explicit Shared(std::string folder)
      : system(OIIO::TextureSystem::create(false)), temporary_parent(std::move(folder)) {}

  std::string next_file() {
    const std::lock_guard lock(mutex);
    if (!temporary) temporary.emplace(temporary_parent);
    return temporary->file(std::to_string(next_number++) + ".exr");
  }
  bool reserve_resident(size_t bytes) {
    const std::lock_guard lock(mutex);
    if (resident_bytes + bytes > resident_total) return false;
    resident_bytes += bytes;
    return true;
  }

  // The folder goes after the system that reads from it.
  std::optional<TemporaryFolder> temporary;
  std::unique_ptr<OIIO::TextureSystem, Destroy> system;
  const std::string temporary_parent;
  mutable std::mutex mutex;
  std::map<Key, std::weak_ptr<const TextureHandle::Opened>> opened;
  int next_number = 0;
  size_t resident_bytes = 0;
};

struct TextureHandle::Opened {
  int width = 0, height = 0, channels = 0;
  size_t not_numbers = 0;
  bool weighted = false;  ///< the file has a channel more: weights, by which all others are multiplied
  std::optional<std::array<float, 3>> constant;
  Image resident;    ///< the finest level; empty for large images
  std::string name;  ///< for messages
  std::shared_ptr<TextureSystem::Shared> shared;
  OIIO::TextureSystem::TextureHandle* file = nullptr;

  void open_file(const std::string& path, const FileLoc& loc);
  /// `weights`: of the texels, none where all count the same.
  static std::shared_ptr<Opened> convert(std::shared_ptr<TextureSystem::Shared> shared, Image image,
                                         std::span<const float> weights, SampleType type, const std::string& name,
                                         const FileLoc& loc);
};

void TextureHandle::Opened::open_file(const std::string& path, const FileLoc& loc) {
  file = shared->system->get_texture_handle(OIIO::ustring(path));
  if (!file || !shared->system->good(file))
    throw InputError(loc, "cannot use image \"" + name + "\" as a texture: " + shared->system->geterror());
}

std::shared_ptr<TextureHandle::Opened> TextureHandle::Opened::convert(std::shared_ptr<TextureSystem::Shared> shared,
                                                                      Image image, std::span<const float> weights,
                                                                      SampleType type, const std::string& name,
                                                                      const FileLoc& loc) {
  const auto opened = std::make_shared<Opened>();
  opened->width = image.width();
  opened->height = image.height();
  opened->channels = image.channels();
  opened->name = name;
  opened->shared = std::move(shared);
  opened->not_numbers =
      size_t(std::count_if(image.pixels().begin(), image.pixels().end(), [](float v) { return std::isnan(v); }));
  quantize(image, type);
  opened->constant = uniform_value(image, weights);
  opened->weighted = !weights.empty();
  if (opened->weighted) {
    image = weighted_texels(image, weights);
    quantize(image, type);
  }
  const size_t samples = image.pixels().size();
  if (samples <= resident_limit && opened->shared->reserve_resident(samples * sizeof(float))) opened->resident = image;
  const std::string path = opened->shared->next_file();
  write_mip_pyramid(path, std::move(image), type);
  opened->open_file(path, loc);
  return opened;
}

V2i TextureHandle::resolution() const {
  return {opened_->width, opened_->height};
}
int TextureHandle::channels() const {
  return opened_->channels;
}
std::optional<std::array<float, 3>> TextureHandle::constant() const {
  return opened_->constant;
}

size_t TextureHandle::not_numbers() const {
  return opened_->not_numbers;
}

void TextureHandle::lookup(const TextureCoordinates& at, const TextureSampling& sampling, int channels,
                           float* out) const {
  const Opened& o = *opened_;
  // A constant image still ends at its edges where they are black.
  const bool constant = o.constant && sampling.wrap != Wrap::black;
  if (constant) {
    for (int i = 0; i < at.count; ++i) store(o.constant->data(), o.channels, channels, out + i * channels);
    return;
  }
  OIIO::TextureSystem& system = *o.shared->system;
  OIIO::TextureSystem::Perthread* thread = nullptr;
  OIIO::TextureOpt options = oiio_options(sampling);
  for (int i = 0; i < at.count; ++i) {
    const Probe p(at, i, sampling.wrap);
    float value[4];
    if (!o.resident.empty() && p.within_a_texel(o.width, o.height)) {
      look_up_resident(o.resident, p, sampling, value);
    } else {
      if (!thread) thread = system.get_perthread_info();
      if (!system.texture(o.file, thread, options, p.s, p.t, p.dsdx, p.dtdx, p.dsdy, p.dtdy, o.channels + o.weighted,
                          value))
        throw InputError(FileLoc{o.name, 0, 0}, "cannot read texture: " + system.geterror());
    }
    if (o.weighted) divide_by_weight(o.channels, value);
    store(value, o.channels, channels, out + i * channels);
  }
}

TextureSystem::TextureSystem(uint64_t cache_bytes, std::string temporary_folder)
    : shared_(std::make_shared<Shared>(std::move(temporary_folder))) {
  // OpenImageIO refuses less than a few tiles.
  shared_->system->attribute("max_memory_MB",
                             std::max(1.0f, static_cast<float>(static_cast<double>(cache_bytes) / (1 << 20))));
  // Conversion leaves nothing for the cache to guess.
  shared_->system->attribute("automip", 0);
}

TextureHandle TextureSystem::open(const std::string& path, Encoding encoding, TextureUse use, const FileLoc& loc,
                                  const TextureWeight& weight) {
  std::error_code ignored;
  const std::string canonical = std::filesystem::weakly_canonical(path, ignored).string();
  const Shared::Key key{canonical.empty() ? path : canonical,
                        encoding.kind,
                        encoding.exponent,
                        use,
                        weight.by,
                        weight.path,
                        weight.encoding.kind,
                        weight.encoding.exponent,
                        weight.scale,
                        weight.invert};
  TextureHandle handle;
  {
    const std::lock_guard lock(shared_->mutex);
    handle.opened_ = shared_->opened[key].lock();
  }
  if (handle.opened_) return handle;

  const ImageInfo info = read_image_info(path, loc);
  const bool may_be_weighted =
      use == TextureUse::color &&
      (weight.by == TextureWeight::By::picture || (weight.by == TextureWeight::By::own_alpha && info.has_alpha()));
  Image image;
  std::vector<float> weights;
  if (may_be_weighted) {
    image = read_image(path, loc, encoding);
    if (info.associated_alpha() && weight.by != TextureWeight::By::nothing) divide_by_alpha(image);
    weights = weights_of(image, weight, loc);
  }
  if (weights.empty() && usable_in_place(info, encoding, use)) {
    const auto opened = std::make_shared<TextureHandle::Opened>();
    opened->width = info.width;
    opened->height = info.height;
    opened->channels = info.channels >= 3 ? 3 : 1;
    opened->name = path;
    opened->shared = shared_;
    opened->open_file(path, loc);
    handle.opened_ = opened;
  } else {
    if (image.empty()) image = read_image(path, loc, encoding);
    handle.opened_ =
        TextureHandle::Opened::convert(shared_, select_channels(image, use), weights, storage_type(use), path, loc);
  }
  const std::lock_guard lock(shared_->mutex);
  shared_->opened[key] = handle.opened_;
  return handle;
}

TextureHandle TextureSystem::add(const Image& image, TextureUse use, const std::string& name) {
  TextureHandle handle;
  const FileLoc loc{name, 0, 0};
  const std::vector<float> weights = use == TextureUse::color ? weights_of(image, {}, loc) : std::vector<float>();
  handle.opened_ =
      TextureHandle::Opened::convert(shared_, select_channels(image, use), weights, storage_type(use), name, loc);
  return handle;
}

TextureStatistics TextureSystem::statistics() const {
  const OIIO::TextureSystem& system = *shared_->system;
  const auto number = [&](const char* name) {
    long long v = 0;
    if (system.getattribute(name, OIIO::TypeDesc::INT64, &v)) return static_cast<uint64_t>(v);
    int i = 0;
    return system.getattribute(name, OIIO::TypeInt, &i) ? static_cast<uint64_t>(i) : uint64_t{0};
  };
  TextureStatistics s;
  s.lookups = number("stat:find_tile_calls");
  s.fills = number("stat:tiles_created");
  s.hits = s.lookups - std::min(s.lookups, number("stat:find_tile_cache_misses"));
  s.evictions = s.fills - std::min(s.fills, number("stat:tiles_current"));
  s.bytes = number("stat:cache_memory_used");
  float seconds = 0;
  if (system.getattribute("stat:fileio_time", OIIO::TypeFloat, &seconds)) s.fill_seconds = seconds;
  const uint64_t tiles = number("stat:tiles_current");
  s.peak_bytes = tiles ? s.bytes * number("stat:tiles_peak") / tiles : s.bytes;
  const std::lock_guard lock(shared_->mutex);
  s.resident_bytes = shared_->resident_bytes;
  for (const auto& [key, opened] : shared_->opened) s.files += opened.expired() ? 0 : 1;
  return s;
}

}  // namespace dapple::image
