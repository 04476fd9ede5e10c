// SPDX-License-Identifier: Apache-2.0
#include "dapple/image/environment.h"

#include <algorithm>
#include <cmath>

#include "dapple/base/parallel.h"

namespace dapple::image {

namespace {

/// arctan(y / x) * 2 / pi for x, y >= 0: a quarter turn is 1.
float quarter_turns(float y, float x) {
  return x == 0 && y == 0 ? 0.0f : std::atan2(y, x) * (2 * inv_pi);
}

struct Texel {
  int x, y;
};

/// The texel of a square octahedral map that lies where (x, y), at most one side beyond an edge, folds to.
Texel fold_octahedral(int x, int y, int n) {
  if (x < 0) {
    x = -1 - x;
    y = n - 1 - y;
  } else if (x >= n) {
    x = 2 * n - 1 - x;
    y = n - 1 - y;
  }
  if (y < 0) {
    y = -1 - y;
    x = n - 1 - x;
  } else if (y >= n) {
    y = 2 * n - 1 - y;
    x = n - 1 - x;
  }
  return {std::clamp(x, 0, n - 1), std::clamp(y, 0, n - 1)};
}

/// Beyond a pole, the map goes on half a turn further.
Texel fold_latitude_longitude(int x, int y, int width, int height) {
  if (y < 0 || y >= height) {
    y = y < 0 ? -1 - y : 2 * height - 1 - y;
    x += width / 2;
  }
  x %= width;
  return {x < 0 ? x + width : x, std::clamp(y, 0, height - 1)};
}

// The bound leaves room for sums.
float sane(float v) {
  return v > 0 ? std::min(v, 1e30f) : 0.0f;
}

}  // namespace

V3f equal_area_direction(const V2f& uv) {
  // One quadrant is a triangle of the upper half (inside the diamond) and one of the lower; r is the distance from the
  // pole, as the square root of area, and phi runs along it.
  const float x = 2 * uv.x - 1, y = 2 * uv.y - 1;
  const float ax = std::abs(x), ay = std::abs(y);
  const float height = 1 - (ax + ay);
  const float r = 1 - std::abs(height);
  const float phi = (pi / 4) * (r == 0 ? 1 : (ay - ax) / r + 1);
  const float z = std::copysign(1 - r * r, height);
  const float s = r * safe_sqrt(2 - r * r);
  return {std::copysign(std::cos(phi), x) * s, std::copysign(std::sin(phi), y) * s, z};
}

V2f equal_area_uv(const V3f& d) {
  const float ax = std::abs(d.x), ay = std::abs(d.y), az = std::abs(d.z);
  // r^2 = 1 - |z|, computed from x and y near the pole, where 1 - |z| would lose all digits.
  const float r2 = az > 0.5f ? (ax * ax + ay * ay) / (1 + az) : 1 - az;
  const float r = safe_sqrt(r2);
  float v = quarter_turns(ay, ax) * r;
  float u = r - v;
  if (std::signbit(d.z)) {
    const float swap = u;
    u = 1 - v;
    v = 1 - swap;
  }
  return {std::clamp((std::copysign(u, d.x) + 1) / 2, 0.0f, 1.0f),
          std::clamp((std::copysign(v, d.y) + 1) / 2, 0.0f, 1.0f)};
}

V3f latitude_longitude_direction(const V2f& uv) {
  const float phi = 2 * pi * uv.x, theta = pi * uv.y;
  const float s = std::sin(theta);
  return {s * std::cos(phi), s * std::sin(phi), std::cos(theta)};
}

V2f latitude_longitude_uv(const V3f& d) {
  const float phi = std::atan2(d.y, d.x);
  const float theta = std::atan2(std::sqrt(d.x * d.x + d.y * d.y), d.z);
  return {std::clamp((phi < 0 ? phi + 2 * pi : phi) / (2 * pi), 0.0f, 1.0f), std::clamp(theta * inv_pi, 0.0f, 1.0f)};
}

EnvironmentImage::EnvironmentImage(const Image& image, std::optional<EnvironmentMapping> mapping, const FileLoc& loc) {
  const int width = image.width(), height = image.height();
  const std::string size = std::to_string(width) + "x" + std::to_string(height);
  if (!mapping && width != height && width != 2 * height)
    throw InputError(loc, "an environment image of " + size +
                              " pixels; expected a square one (equal-area octahedral) or one twice as wide as high "
                              "(latitude-longitude)");
  mapping_ =
      mapping.value_or(width == height ? EnvironmentMapping::equal_area : EnvironmentMapping::latitude_longitude);
  if (mapping_ == EnvironmentMapping::equal_area && width != height)
    throw InputError(loc, "an equal-area environment image must be square; this one has " + size + " pixels");

  Level& level = levels_.emplace_back();
  level.width = width;
  level.height = height;
  level.texels.resize(static_cast<size_t>(width) * static_cast<size_t>(height));
  parallel_for(static_cast<size_t>(height), [&](size_t y) {
    for (int x = 0; x < width; ++x) {
      const RGB c = image.rgb(x, static_cast<int>(y));
      level.texels[y * static_cast<size_t>(width) + static_cast<size_t>(x)] = {sane(c.r), sane(c.g), sane(c.b)};
    }
  });
  build_levels();
}

EnvironmentImage EnvironmentImage::read(const std::string& path, std::string_view mapping, const FileLoc& loc,
                                        Encoding encoding) {
  std::optional<EnvironmentMapping> chosen;
  if (mapping == "equalarea") chosen = EnvironmentMapping::equal_area;
  if (mapping == "latlong") chosen = EnvironmentMapping::latitude_longitude;
  if (!chosen && !mapping.empty())
    throw InputError(loc, "unknown mapping \"" + std::string(mapping) + "\", " + one_of({"equalarea", "latlong"}));
  return {read_image(path, loc, encoding), chosen, loc};
}

void EnvironmentImage::build_levels() {
  // Means are weighted by solid angle; rows of a latitude-longitude map shrink towards the poles.
  std::vector<double> sum(3, 0.0);
  for (int y = 0; y < height(); ++y) {
    double row[3] = {0, 0, 0};
    for (int x = 0; x < width(); ++x)
      for (int c = 0; c < 3; ++c) row[c] += texel(x, y)[c];
    for (int c = 0; c < 3; ++c) sum[c] += row[c] * texel_solid_angle(y);
  }
  for (int c = 0; c < 3; ++c) mean_[c] = static_cast<float>(sum[c] / (4 * std::numbers::pi));

  while (levels_.back().width > 1 && levels_.back().height > 1) {
    Level next;
    const Level& last = levels_.back();
    next.width = last.width / 2;
    next.height = last.height / 2;
    next.texels.resize(static_cast<size_t>(next.width) * static_cast<size_t>(next.height));
    parallel_for(static_cast<size_t>(next.height), [&](size_t row) {
      const int y = static_cast<int>(row);
      // An odd side loses its last line to the neighbour: three lines make one.
      const int y0 = 2 * y, y1 = y == next.height - 1 ? last.height : y0 + 2;
      for (int x = 0; x < next.width; ++x) {
        const int x0 = 2 * x, x1 = x == next.width - 1 ? last.width : x0 + 2;
        RGB total;
        for (int j = y0; j < y1; ++j)
          for (int i = x0; i < x1; ++i) total += last.at(i, j) * (1.0f / static_cast<float>((x1 - x0) * (y1 - y0)));
        next.texels[row * static_cast<size_t>(next.width) + static_cast<size_t>(x)] = total;
      }
    });
    levels_.push_back(std::move(next));
  }
}

V3f EnvironmentImage::direction(const V2f& at) const {
  return mapping_ == EnvironmentMapping::equal_area ? equal_area_direction(at) : latitude_longitude_direction(at);
}

V2f EnvironmentImage::uv(const V3f& d) const {
  return mapping_ == EnvironmentMapping::equal_area ? equal_area_uv(d) : latitude_longitude_uv(d);
}

float EnvironmentImage::solid_angle_per_area(const V2f& at) const {
  return mapping_ == EnvironmentMapping::equal_area ? 4 * pi
                                                    : 2 * pi * pi * std::sin(pi * std::clamp(at.y, 0.0f, 1.0f));
}

float EnvironmentImage::texel_solid_angle(int y) const {
  const double h = height(), w = width();
  if (mapping_ == EnvironmentMapping::equal_area) return static_cast<float>(4 * std::numbers::pi / (w * h));
  // cos a - cos b = 2 sin((a + b) / 2) sin((b - a) / 2)
  const double middle = std::numbers::pi * (y + 0.5) / h, half = std::numbers::pi / (2 * h);
  return static_cast<float>(2 * std::numbers::pi / w * 2 * std::sin(middle) * std::sin(half));
}

size_t EnvironmentImage::wrapped(const Level& level, int x, int y) const {
  const Texel t = mapping_ == EnvironmentMapping::equal_area ? fold_octahedral(x, y, level.width)
                                                             : fold_latitude_longitude(x, y, level.width, level.height);
  return level.index(t.x, t.y);
}

RGB EnvironmentImage::nearest(const V3f& d) const {
  const V2f at = uv(d);
  return texel(std::min(static_cast<int>(at.x * static_cast<float>(width())), width() - 1),
               std::min(static_cast<int>(at.y * static_cast<float>(height())), height() - 1));
}

EnvironmentImage::Corners EnvironmentImage::corners(const Level& level, const V2f& at) const {
  const float x = at.x * static_cast<float>(level.width) - 0.5f, y = at.y * static_cast<float>(level.height) - 0.5f;
  const float fx = std::floor(x), fy = std::floor(y);
  const int ix = static_cast<int>(fx), iy = static_cast<int>(fy);
  const float right = x - fx, down = y - fy;
  if (ix >= 0 && iy >= 0 && ix + 1 < level.width && iy + 1 < level.height) {
    const size_t first = level.index(ix, iy), below = first + static_cast<size_t>(level.width);
    return {{first, first + 1, below, below + 1}, right, down};
  }
  return {
      {wrapped(level, ix, iy), wrapped(level, ix + 1, iy), wrapped(level, ix, iy + 1), wrapped(level, ix + 1, iy + 1)},
      right,
      down};
}

void EnvironmentImage::bilinear(std::span<const V2f> at, RGB* out) const {
  constexpr size_t at_once = 16;
  const Level& level = levels_.front();
  for (; at.size() > at_once; at = at.subspan(at_once), out += at_once) bilinear(at.first(at_once), out);
  Corners found[at_once];
  for (size_t i = 0; i < at.size(); ++i) {
    found[i] = corners(level, at[i]);
    __builtin_prefetch(&level.texels[found[i].texel[0]]);
    __builtin_prefetch(&level.texels[found[i].texel[2]]);
  }
  for (size_t i = 0; i < at.size(); ++i) out[i] = found[i].mean(level);
}

RGB EnvironmentImage::filtered(const V3f& d, float cone) const {
  // Width of a texel of the finest level, from its mean solid angle.
  const float texel = std::sqrt(4 * pi / (static_cast<float>(width()) * static_cast<float>(height())));
  const float last = static_cast<float>(levels_.size() - 1);
  const float lod = cone > texel ? std::min(std::log2(cone / texel), last) : 0.0f;
  const size_t level = static_cast<size_t>(lod);
  const float t = lod - static_cast<float>(level);
  const V2f at = uv(d);
  const RGB fine = bilinear(levels_[level], at);
  return t > 0 ? lerp(t, fine, bilinear(levels_[level + 1], at)) : fine;
}

}  // namespace dapple::image
