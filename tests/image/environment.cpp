// SPDX-License-Identifier: Apache-2.0
#include "dapple/image/environment.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "dapple/base/hash.h"
#include "dapple/numeric/warp.h"
#include "tests/image/temporary_folder.h"

namespace dapple::image {
namespace {

V2f random_square(KeyedRng& rng) {
  const float x = rng.next();
  return {x, rng.next()};
}

struct Map {
  const char* name;
  V3f (*direction)(const V2f&);
  V2f (*uv)(const V3f&);
};
constexpr Map maps[] = {{"equal area", equal_area_direction, equal_area_uv},
                        {"latitude-longitude", latitude_longitude_direction, latitude_longitude_uv}};

TEST(EnvironmentMaps, AreInversePairs) {
  for (const Map& map : maps) {
    SCOPED_TRACE(map.name);
    KeyedRng rng(1);
    for (int i = 0; i < 100000; ++i) {
      const V3f d = square_to_sphere(random_square(rng));
      const V3f back = map.direction(map.uv(d));
      ASSERT_NEAR(length(back), 1, 1e-5f);
      ASSERT_LT(length(back - d), 3e-6f) << d.x << " " << d.y << " " << d.z;
      const V2f at{0.001f + 0.998f * rng.next(), 0.001f + 0.998f * rng.next()};
      const V2f there = map.uv(map.direction(at));
      // Close to a pole u is anything.
      const float slack = 2e-6f / std::max(0.001f, std::sin(pi * at.y));
      ASSERT_NEAR(there.x, at.x, slack);
      ASSERT_NEAR(there.y, at.y, 2e-5f);
    }
  }
}

TEST(EnvironmentMaps, PolesAndAxes) {
  const V3f axes[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  for (const Map& map : maps)
    for (const V3f& d : axes) {
      SCOPED_TRACE(map.name);
      EXPECT_LT(length(map.direction(map.uv(d)) - d), 1e-6f);
    }
  EXPECT_EQ(equal_area_uv({0, 0, 1}), V2f(0.5f, 0.5f));
  EXPECT_EQ(equal_area_uv({1, 0, 0}), V2f(1, 0.5f));
  EXPECT_EQ(equal_area_uv({0, 1, 0}), V2f(0.5f, 1));
  const V2f below = equal_area_uv({0, 0, -1});
  EXPECT_TRUE((below.x == 0 || below.x == 1) && (below.y == 0 || below.y == 1));
  EXPECT_EQ(latitude_longitude_uv({0, 0, 1}).y, 0);
  EXPECT_EQ(latitude_longitude_uv({0, 0, -1}).y, 1);
  EXPECT_NEAR(latitude_longitude_uv({0, 1, 0}).x, 0.25f, 1e-6f);
  EXPECT_NEAR(latitude_longitude_uv({0, -1, 0}).x, 0.75f, 1e-6f);
}

/// |d direction/du x d direction/dv| by central differences is d omega / (du dv).
TEST(EnvironmentMaps, SolidAngleIsTheJacobian) {
  const EnvironmentImage square(Image(2, 2, 3), {}, {}), wide(Image(4, 2, 3), {}, {});
  for (const EnvironmentImage* map : {&square, &wide}) {
    KeyedRng rng(2);
    for (int i = 0; i < 2000; ++i) {
      const V2f at{0.02f + 0.96f * rng.next(), 0.02f + 0.96f * rng.next()};
      const float h = 1e-3f;
      // The square's diagonals and axes are creases.
      const float x = std::abs(2 * at.x - 1), y = std::abs(2 * at.y - 1);
      if (map == &square && (x < 4 * h || y < 4 * h || std::abs(x + y - 1) < 6 * h)) continue;
      const V3f du = (map->direction({at.x + h, at.y}) - map->direction({at.x - h, at.y})) / (2 * h);
      const V3f dv = (map->direction({at.x, at.y + h}) - map->direction({at.x, at.y - h})) / (2 * h);
      const float expected = map->solid_angle_per_area(at);
      ASSERT_NEAR(length(cross(du, dv)) / expected, 1, map == &square ? 0.02f : 0.002f) << at.x << " " << at.y;
    }
  }
}

TEST(EnvironmentImage, TexelsMakeTheWholeSphere) {
  for (const auto& [w, h] : {std::pair{16, 16}, {32, 16}, {7, 7}, {10, 5}}) {
    const EnvironmentImage map(Image(w, h, 3), {}, {});
    double sum = 0;
    for (int y = 0; y < h; ++y) sum += map.texel_solid_angle(y) * w;
    EXPECT_NEAR(sum, 4 * pi, 1e-5) << w;
  }
}

/// A map of a smooth function of direction must look continuous everywhere, in particular over its seams and corners.
TEST(EnvironmentImage, FilteringKnowsTheSeams) {
  const auto f = [](const V3f& d) { return RGB(1 + d.x, 1 + d.y, 1 + d.z); };
  for (const auto& [w, h] : {std::pair{64, 64}, {128, 64}}) {
    Image image(w, h, 3);
    const EnvironmentImage shape(image, {}, {});
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) {
        const RGB c = f(shape.direction({(x + 0.5f) / w, (y + 0.5f) / h}));
        std::copy_n(&c.r, 3, image.pixel(x, y));
      }
    const EnvironmentImage map(image, {}, {});
    KeyedRng rng(3);
    for (int i = 0; i < 50000; ++i) {
      V3f d = square_to_sphere(random_square(rng));
      if (i % 2) d = normalize(V3f(d.x * 0.05f, d.y, d.z));  // more of them about the seams
      const RGB got = map.bilinear(d), wide = map.filtered(d, 0.2f), near = map.nearest(d), want = f(d);
      for (int c = 0; c < 3; ++c) {
        ASSERT_NEAR(got[c], want[c], 0.05f) << w << ": " << d.x << " " << d.y << " " << d.z;
        ASSERT_NEAR(wide[c], want[c], 0.15f) << w << ": " << d.x << " " << d.y << " " << d.z;
        ASSERT_NEAR(near[c], want[c], 0.1f) << w << ": " << d.x << " " << d.y << " " << d.z;
      }
    }
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(map.mean()[c], 1, 1e-4f);
  }
}

TEST(EnvironmentImage, ShapesAndNames) {
  EXPECT_EQ(EnvironmentImage(Image(8, 8, 3), {}, {}).mapping(), EnvironmentMapping::equal_area);
  EXPECT_EQ(EnvironmentImage(Image(16, 8, 3), {}, {}).mapping(), EnvironmentMapping::latitude_longitude);
  EXPECT_THROW(EnvironmentImage(Image(9, 8, 3), {}, {}), InputError);
  EXPECT_THROW(EnvironmentImage(Image(16, 8, 3), EnvironmentMapping::equal_area, {}), InputError);
  EXPECT_NO_THROW(EnvironmentImage(Image(9, 8, 3), EnvironmentMapping::latitude_longitude, {}));
  const test::TemporaryFolder folder;
  EXPECT_THROW(EnvironmentImage::read(folder.file("none.exr"), "", {}), InputError);
  EXPECT_THROW(EnvironmentImage::read(folder.file("none.exr"), "mirrorball", {}), InputError);
}

TEST(EnvironmentImage, BadNumbersAreBlack) {
  Image image(2, 2, 3);
  image.pixel(0, 0)[0] = -1;
  image.pixel(1, 0)[1] = std::numeric_limits<float>::quiet_NaN();
  image.pixel(0, 1)[2] = infinity;
  const EnvironmentImage map(image, {}, {});
  EXPECT_EQ(map.texel(0, 0).r, 0);
  EXPECT_EQ(map.texel(1, 0).g, 0);
  EXPECT_TRUE(std::isfinite(map.texel(0, 1).b));
}

}  // namespace
}  // namespace dapple::image
