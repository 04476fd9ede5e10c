// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "dapple/base/error.h"
#include "dapple/base/vec.h"
#include "dapple/image/image.h"

namespace dapple::image {

/// What happens outside [0, 1].
enum class Wrap : uint8_t { repeat, black, clamp };

/// pbrt's filters. All but point interpolate between texels; all choose from the mip pyramid by the footprint.
enum class TextureFilter : uint8_t {
  point,      ///< nearest texel of the level whose texels are as large as the footprint
  bilinear,   ///< the same level, interpolated
  trilinear,  ///< and between the two levels about it
  ewa         ///< several trilinear probes along the footprint's long axis
};

struct TextureSampling {
  Wrap wrap = Wrap::repeat;
  TextureFilter filter = TextureFilter::bilinear;
  float max_anisotropy = 8;  ///< ewa: longest over shortest axis before the footprint is widened
};

/// Where to look, for `count` points. s runs to the right and t upwards: (0, 0) is the lower left corner of the
/// picture, as in pbrt. Derivative arrays are all null (no footprint: the finest level) or all given. Coordinates that
/// are not finite count as 0.
struct TextureCoordinates {
  int count = 0;
  const float *s = nullptr, *t = nullptr;
  const float *dsdx = nullptr, *dtdx = nullptr, *dsdy = nullptr, *dtdy = nullptr;
};

/// What an image is to be used for.
enum class TextureUse : uint8_t {
  color,  ///< R, G, B; grey images have one channel; see TextureWeight for what alpha does
  /// One channel. Of a colour image: alpha where it is not 1 everywhere, else the mean of R, G, B (as pbrt-v4).
  scalar
};

/// By what each texel of a colour image counts when colours are averaged, at all levels: a colour is the mean of what
/// is there, sum(a c) / sum(a), so that what is cut away has no colour, whatever the file says there. Images of other
/// uses, and those that are 1 everywhere, are averaged as they are.
struct TextureWeight {
  enum class By : uint8_t {
    own_alpha,  ///< the image's alpha channel, where it has one
    picture,    ///< that, times the values of another picture of the same size as a scalar: the `alpha` of a shape
    nothing
  };
  By by = By::own_alpha;
  std::string path;  ///< of the other picture; values v of it count (invert ? 1 - v : v) * scale, within 0 and 1
  Encoding encoding;
  float scale = 1;
  bool invert = false;
  friend bool operator==(const TextureWeight&, const TextureWeight&) = default;
};

/// An image opened for look-ups. A cheap value; copies share. Keeps what it needs of its TextureSystem alive.
/// Thread-safe.
class TextureHandle {
 public:
  V2i resolution() const;
  int channels() const;  ///< 1 or 3
  /// The value of all texels, where it is the same everywhere.
  std::optional<std::array<float, 3>> constant() const;
  /// Numbers of the file that are none (NaN) and are read as 0; not counted in files that are used in place.
  size_t not_numbers() const;
  /// Filtered linear values, `channels` (1 or 3) for each point, interleaved. Grey is repeated in three channels; of
  /// colour, one channel is the mean. Deterministic; no locks beyond the tile cache's own. IoError if a file fails that
  /// was good when opened.
  void lookup(const TextureCoordinates& at, const TextureSampling& sampling, int channels, float* out) const;

 private:
  friend class TextureSystem;
  struct Opened;
  std::shared_ptr<const Opened> opened_;
};

struct TextureStatistics {
  uint64_t lookups = 0, hits = 0, fills = 0, evictions = 0;  ///< of tiles
  uint64_t bytes = 0, peak_bytes = 0;                        ///< held in the cache
  double fill_seconds = 0;                                   ///< reading and unpacking tiles, all threads together
  int files = 0;
  uint64_t resident_bytes = 0;  ///< of small images held whole beside the cache
};

/// Images for look-ups, paged in by tiles and bounded in memory; OpenImageIO's TextureSystem and cache.
///
/// OpenImageIO filters numbers as they are stored. Therefore an image is decoded to linear, reduced to a mip pyramid by
/// exact area averages and stored in tiles (colour in half precision, scalars in float) in a private
/// temporary folder when it is first opened; it goes with the last user, and with the next run if this one is killed.
/// Linear files that already are tiled pyramids are used in place.
///
/// A look-up costs about 30 ns in a small image without footprint, 100 ns point or bilinear, 350 ns trilinear and
/// 500-700 ns ewa where neighbours are close together; scattered ones two to four times as much (one core, 2.5 GHz).
///
/// Small images (up to 2^20 numbers, 256 MiB together, in the order of opening) are also held whole, for look-ups
/// without a footprint: the alpha test of a ray must not cost more than the ray.
class TextureSystem {
 public:
  /// cache_bytes bounds the tile cache, which never changes a result. temporary_folder: where converted images go,
  /// empty for the system's ($TMPDIR).
  explicit TextureSystem(uint64_t cache_bytes = uint64_t{1} << 30, std::string temporary_folder = {});

  /// Throws InputError as read_image() does, and where `weight` names a picture of another size. The same file,
  /// encoding, use and weight give the same handle.
  TextureHandle open(const std::string& path, Encoding encoding, TextureUse use, const FileLoc& loc,
                     const TextureWeight& weight = {});
  /// The same for an image in memory; `name` only serves messages.
  TextureHandle add(const Image& image, TextureUse use, const std::string& name);

  TextureStatistics statistics() const;

 private:
  friend class TextureHandle;
  struct Shared;
  std::shared_ptr<Shared> shared_;
};

}  // namespace dapple::image
