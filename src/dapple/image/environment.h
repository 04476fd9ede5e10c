// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "dapple/base/rgb.h"
#include "dapple/base/vec.h"
#include "dapple/image/image.h"

namespace dapple::image {

/// How an image wraps the sphere of directions. Directions are in the light's space, unit, from the scene towards the
/// sky; z is up. uv is in [0, 1]^2 with v = 0 at the top row of the image.
enum class EnvironmentMapping : uint8_t {
  /// The whole sphere on a square, +z in the middle, -z at the four corners, areas kept (Clarberg 2008; pbrt-v4's image
  /// infinite lights).
  equal_area,
  /// u = phi / 2 pi, phi = atan2(y, x) in [0, 2 pi); v = theta / pi, theta from +z. As pbrt-v4's `imgtool makeequiarea`
  /// takes its input.
  latitude_longitude
};

V3f equal_area_direction(const V2f& uv);
V2f equal_area_uv(const V3f& direction);
V3f latitude_longitude_direction(const V2f& uv);
V2f latitude_longitude_uv(const V3f& direction);

/// Radiance (or a scale on it) from every direction, linear RGB in float: what an infinite light samples. Texels are
/// non-negative and finite.
class EnvironmentImage {
 public:
  /// Without a mapping, a square image is equal_area and a 2:1 image latitude_longitude; others throw InputError.
  EnvironmentImage(const Image& image, std::optional<EnvironmentMapping> mapping, const FileLoc& loc);
  /// Reads a file. `mapping` is "equalarea", "latlong" or empty: by the shape.
  static EnvironmentImage read(const std::string& path, std::string_view mapping, const FileLoc& loc,
                               Encoding encoding = Encoding::automatic());

  EnvironmentMapping mapping() const { return mapping_; }
  int width() const { return levels_.front().width; }
  int height() const { return levels_.front().height; }
  RGB texel(int x, int y) const { return levels_.front().at(x, y); }

  V3f direction(const V2f& uv) const;
  V2f uv(const V3f& direction) const;
  /// d omega / (du dv): 4 pi for equal_area, 2 pi^2 sin(theta) for latitude_longitude. A density in uv divided by it is
  /// one in solid angle.
  float solid_angle_per_area(const V2f& uv) const;
  /// Solid angle (sr) of one texel of row y, exact; all texels of all rows together make 4 pi.
  float texel_solid_angle(int y) const;

  /// The texel a direction falls in: constant over texels, as a piecewise-constant sampling density is.
  RGB nearest(const V3f& direction) const;
  /// Between the four texels around, continuous over the seams of the map.
  RGB bilinear(const V3f& direction) const { return bilinear(uv(direction)); }
  RGB bilinear(const V2f& uv) const { return bilinear(levels_.front(), uv); }
  /// The same at each of several places, which wait for memory together.
  void bilinear(std::span<const V2f> uv, RGB* out) const;
  /// Averaged over a cone about `cone` radians across; bilinear where that is less than a texel.
  RGB filtered(const V3f& direction, float cone) const;

  /// Mean over the sphere.
  RGB mean() const { return mean_; }

 private:
  struct Level {
    int width = 0, height = 0;
    std::vector<RGB> texels;
    size_t index(int x, int y) const {
      return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
    }
    RGB at(int x, int y) const { return texels[index(x, y)]; }
  };
  /// The four texels around a place, and its share of the right and the lower ones.
  struct Corners {
    size_t texel[4];
    float right, down;

    RGB mean(const Level& level) const {
      const auto& t = level.texels;
      return lerp(down, lerp(right, t[texel[0]], t[texel[1]]), lerp(right, t[texel[2]], t[texel[3]]));
    }
  };
  Corners corners(const Level& level, const V2f& uv) const;
  size_t wrapped(const Level& level, int x, int y) const;
  RGB bilinear(const Level& level, const V2f& uv) const { return corners(level, uv).mean(level); }
  void build_levels();

  EnvironmentMapping mapping_;
  std::vector<Level> levels_;  ///< [0] the image; each next half as large
  RGB mean_;
};

}  // namespace dapple::image
