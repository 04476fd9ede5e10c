// SPDX-License-Identifier: Apache-2.0
// Closed forms of the illumination by correlation (illumination under trees, 3.5).
#include "dapple/forest/penumbra.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"

namespace dapple::forest {
namespace {

constexpr double pi_d = std::numbers::pi;
constexpr double degree = pi_d / 180;

CanopyMask mask_of(int width, int height, double pitch, bool periodic, const std::function<float(int, int)>& at) {
  CanopyMask mask{Raster(width, height, 1), pitch, periodic};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) mask.transmittance.row(0, y)[x] = at(x, y);
  return mask;
}

CanopyMask noise(int width, int height, double pitch, bool periodic, uint64_t seed = 1) {
  return mask_of(width, height, pitch, periodic, [&](int x, int y) { return to_unit_float(hash(seed, x, y)); });
}

/// E(g) = sum of m(x) w(x - g), cell by cell.
double direct(const CanopyMask& mask, const LightRaster& light, double open, int gx, int gy) {
  const Raster& m = mask.transmittance;
  double e = open;
  for (int y = 0; y < light.window.height; ++y)
    for (int x = 0; x < light.window.width; ++x) {
      int i = gx + light.window.x0 + x, j = gy + light.window.y0 + y;
      if (mask.periodic) {
        i = (i % m.width + m.width) % m.width;
        j = (j % m.height + m.height) % m.height;
      } else if (i < 0 || i >= m.width || j < 0 || j >= m.height) {
        continue;
      }
      e -= (1 - double(m.row(0, j)[i])) * double(light.weight.row(0, y)[x]);
    }
  return e;
}

// Rationale: the transforms, their padding and the origin. Expectation: the double sum on 32 x 32, and on sides that
// transform badly, to 1e-5, with and without repetition, for sky and for sun.
TEST(Penumbra, EqualsDirectSummation) {
  for (const bool periodic : {false, true})
    for (const auto& [width, height] : {std::pair{32, 32}, {31, 17}, {22, 46}}) {
      const CanopyMask mask = noise(width, height, 0.25, periodic);
      const double h = 3;
      const SkyDome sky = SkyDome::cie_clear(sky_direction(0.5, 1)).with_irradiance(100);
      const int reach = periodic ? 96 : 46;  // 8 heights; all of the mask
      const LightRaster light = sky_raster([&](const V3d& w) { return sky.radiance(w) * float(w.z); }, sky.detail(),
                                           true, 0.25 / h, {-reach, -reach, 2 * reach + 1, 2 * reach + 1});
      const double held = light.weight.mean(0) * double(light.weight.values.size());
      PenumbraSettings every_cell;
      every_cell.sky_cell = 0;
      const Raster e = sky_irradiance(mask, h, sky, every_cell);
      const double open = periodic ? held + (100 - held) * mask.mean(0) : 100;
      for (int y = 0; y < height; y += 5)
        for (int x = 0; x < width; x += 3)
          EXPECT_NEAR(e.at(0, x, y), direct(mask, light, open, x, y), 1e-3)
              << width << "x" << height << " at " << x << "," << y;

      const SunDisc sun(40 * degree, 2, RGB(50), LimbDarkening::none, 0.08);
      const LightRaster disc = sun_raster(sun, 0.25 / h, {-100, -100, 200, 200});
      const Raster s = sun_irradiance(mask, h, sun);
      for (int y = 0; y < height; y += 5)
        for (int x = 0; x < width; x += 3)
          EXPECT_NEAR(s.at(0, x, y), direct(mask, disc, 50 * std::cos(40 * degree), x, y), 5e-4)
              << width << "x" << height;
    }
}

// Expectation: light from one direction, through whole pixels, shifts the mask by h tan(zenith) against the sun's
// azimuth, and beyond the mask is open.
TEST(Penumbra, SmallSunShiftsTheMask) {
  const double pitch = 0.5, h = 2;
  for (const bool periodic : {false, true}) {
    const CanopyMask mask = noise(24, 20, pitch, periodic);
    // 3 pixels to +x, 2 pixels to +y, that is up the rows.
    const double zenith = std::atan(std::hypot(1.5, 1.0) / h), azimuth = std::atan2(1.0, 1.5);
    const SunDisc sun(zenith, azimuth, RGB(10), LimbDarkening::none, 1e-4);
    const Raster e = sun_irradiance(mask, h, sun);
    for (int y = 0; y < 20; ++y)
      for (int x = 0; x < 24; ++x) {
        int i = x + 3, j = y - 2;
        if (periodic) i %= 24, j = (j + 20) % 20;
        const float m = i < 24 && j >= 0 ? mask.transmittance.row(0, j)[i] : 1;
        EXPECT_NEAR(e.at(0, x, y), 10 * std::cos(zenith) * double(m), 1e-4) << x << "," << y;
      }
  }
}

// Expectation: through a hole of one pixel a sky of three unlike suns draws its picture, turned by half a turn and as
// large as the height says.
TEST(Penumbra, PinholeGivesTheSkyUpsideDown) {
  const int n = 41, hole = 20;
  const double pitch = 0.1, h = 4;
  const CanopyMask mask =
      mask_of(n, n, pitch, false, [&](int x, int y) { return x == hole && y == hole ? 1.0f : 0.0f; });
  const struct {
    int dx, dy;
    double power;
  } suns[] = {{12, 3, 5}, {-7, 9, 2}, {4, -16, 1}};  // dx to +x, dy to +y
  for (const auto& s : suns) {
    const double r = std::hypot(s.dx, s.dy) * pitch;
    const SunDisc sun(std::atan(r / h), std::atan2(double(s.dy), double(s.dx)), RGB(float(s.power)),
                      LimbDarkening::none, 1e-4);
    const Raster e = sun_irradiance(mask, h, sun);
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        const int i = x + s.dx, j = y - s.dy;  // where the ray meets the sheet, or passes beside it
        const bool lit = i < 0 || i >= n || j < 0 || j >= n || (i == hole && j == hole);
        EXPECT_NEAR(e.at(0, x, y), lit ? s.power * h / std::hypot(h, r) : 0, 1e-5 * s.power) << x << "," << y;
      }
  }
  // And a picture of a sky: bright in the quarter of +x, +y only, which lights the quarter of -x, -y.
  image::Image picture(64, 32, 1);
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x) picture.pixel(x, y)[0] = 1;
  const SkyDome sky = SkyDome::from_image(image::EnvironmentImage(picture, std::nullopt, {}));
  CanopyMask holes = mask;
  holes.periodic = true;  // so that nothing comes in from the sides
  const Raster e = sky_irradiance(holes, 0.5, sky, {.sky_cell = 0});
  EXPECT_GT(e.at(0, hole - 5, hole + 5), 100 * e.at(0, hole + 5, hole + 5));
  EXPECT_GT(e.at(0, hole - 5, hole + 5), 100 * e.at(0, hole - 5, hole - 5));
  EXPECT_GT(e.at(0, hole - 5, hole + 5), 100 * e.at(0, hole + 5, hole - 5));
}

// Expectation: behind an edge the disc of radius R leaves the circular segment 1/2 + (x sqrt(1 - x^2) + asin x) / pi, x
// in radii of its image.
TEST(Penumbra, EdgeGivesTheCircularSegment) {
  const int n = 400;
  const double pitch = 0.002, h = 20;
  const CanopyMask edge = mask_of(n, 8, pitch, true, [&](int x, int) { return x >= 100 && x < 300 ? 1.0f : 0.0f; });
  const SunDisc sun(0, 0, RGB(1), LimbDarkening::none);
  const Raster e = sun_irradiance(edge, h, sun);
  const double radius = h * std::tan(SunDisc::mean_radius) / pitch;  // 46.5 pixels
  for (int x = 20; x < 180; ++x) {
    const double d = std::clamp((x + 0.5 - 100) / radius, -1.0, 1.0);
    EXPECT_NEAR(e.at(0, x, 3), 0.5 + (d * std::sqrt(1 - d * d) + std::asin(d)) / pi_d, 3e-4) << x;
  }
  // Limb darkening draws the profile in: steeper in the middle, and of the same sum.
  const Raster dark = sun_irradiance(edge, h, SunDisc(0, 0, RGB(1)));
  EXPECT_LT(dark.at(1, 80, 3), e.at(0, 80, 3));
  EXPECT_NEAR(dark.mean(0), e.mean(0), 1e-5);
}

// Expectation: of a uniform sky of radiance 1 / pi, |u|, |v| <= U holds (4 / pi) c atan c, c = U / sqrt(1 + U^2): the
// sky's raster, and the light through a square opening.
TEST(Penumbra, UniformSkyThroughASquare) {
  const struct { double U, captured; } table[] = {{1, 0.554}, {2, 0.831}, {4, 0.951}, {8, 0.987}};
  for (const auto& t : table) {
    const double c = t.U / std::sqrt(1 + t.U * t.U), exact = 4 / pi_d * c * std::atan(c);
    EXPECT_NEAR(exact, t.captured, 6e-4);
    const int n = 31;  // the opening; the frame around it is black and 2000 times as high
    const LightRaster light = sky_raster([](const V3d& w) { return RGB(float(w.z) * inv_pi); }, 10, true, 2 * t.U / n,
                                         {-n / 2, -n / 2, n, n});
    EXPECT_NEAR(light.weight.mean(0) * n * n, exact, 2e-6) << t.U;
  }
  // Dark all around the opening as far as the mask reaches, 32 heights: beyond, 4.9e-4 of the light remains.
  const int n = 513, hole = 8;
  const CanopyMask mask = mask_of(n, n, 0.125, false, [&](int x, int y) {
    return std::abs(x - n / 2) <= hole && std::abs(y - n / 2) <= hole ? 1.0f : 0.0f;
  });
  const double U = (hole + 0.5) * 0.125, c = U / std::sqrt(1 + U * U), beyond = n / 2.0 * 0.125,
               d = beyond / std::sqrt(1 + beyond * beyond);
  const double expected = 4 / pi_d * (c * std::atan(c) + 0.25 * pi_d - d * std::atan(d));
  EXPECT_NEAR(sky_irradiance(mask, 1, SkyDome::uniform(), {.sky_cell = 0}).at(0, n / 2, n / 2), expected, 1e-5);
}

// Expectation: a mask of one number c gives c E0 where it repeats, for every light and height, also where pixels are
// far larger or smaller than the height.
TEST(Penumbra, ConstantMasksScaleTheLight) {
  const V3d towards = sky_direction(0.7, 1);
  for (const double h : {0.001, 1.0, 500.0}) {
    const CanopyMask mask = mask_of(16, 12, 0.1, true, [](int, int) { return 0.375f; });
    for (const SkyDome& sky :
         {SkyDome::uniform(), SkyDome::cie_overcast(), SkyDome::cie_clear(towards), SkyDome::preetham(towards, 3)}) {
      const Raster e = sky_irradiance(mask, h, sky.with_irradiance(200));
      for (const float v : e.values) ASSERT_NEAR(v, 0.375 * (e.channels == 1 ? 200 : double(v) / 0.375), 0.02);
      EXPECT_NEAR(e.channels == 1 ? e.mean(0) : 0.2126 * e.mean(0) + 0.7152 * e.mean(1) + 0.0722 * e.mean(2), 75, 0.02)
          << h;
    }
    for (const double zenith : {0.0, 60.0, 89.0}) {
      const Raster e = sun_irradiance(mask, h, SunDisc(zenith * degree, 1, RGB(100)));
      for (const float v : e.values) ASSERT_NEAR(v, 37.5 * std::cos(zenith * degree), 2e-3) << zenith << " " << h;
    }
  }
}

// Rationale: energy. Expectation: under a mask that repeats the mean is the mask's times the open irradiance; under one
// that does not, what is missing is what its opacity takes from the light that passes it: all of it, summed over the
// ground, where the ground is wide enough.
TEST(Penumbra, KeepsEnergy) {
  const CanopyMask tile = noise(48, 32, 0.05, true);
  EXPECT_NEAR(sun_irradiance(tile, 7, SunDisc(0.9, 0.4, RGB(300))).mean(0), 300 * std::cos(0.9) * tile.mean(0), 1e-2);
  EXPECT_NEAR(sky_irradiance(tile, 7, SkyDome::cie_overcast().with_irradiance(120)).mean(0), 120 * tile.mean(0), 2e-2);

  CanopyMask leaf = mask_of(300, 300, 0.1, false,
                            [](int x, int y) { return x >= 140 && x < 150 && y >= 120 && y < 130 ? 0.25f : 1.0f; });
  const Raster e = sun_irradiance(leaf, 5, SunDisc(0.6, 2.0, RGB(100)));
  const double open = 100 * std::cos(0.6);
  EXPECT_NEAR((open - e.mean(0)) * 300 * 300, open * 0.75 * 100, 0.02 * 75);
}

// Rationale: the sky on coarser cells than the mask. Expectation: within 2e-4 of the open irradiance of the sky on the
// cells of the mask.
TEST(Penumbra, CoarseSkyIsNearTheFineOne) {
  for (const bool periodic : {false, true}) {
    const CanopyMask mask =
        mask_of(256, 256, 0.04, periodic, [](int x, int y) { return float((x / 32 + y / 16) % 2); });
    const SkyDome sky = SkyDome::cie_clear(sky_direction(0.8, 0.3)).with_irradiance(1);
    const Raster fine = sky_irradiance(mask, 6, sky, {.sky_cell = 0}), coarse = sky_irradiance(mask, 6, sky);
    for (size_t i = 0; i < fine.values.size(); i += 97)
      EXPECT_NEAR(coarse.values[i], fine.values[i], 2e-4) << i << " " << periodic;
  }
}

// Expectation: masks in colour are three masks.
TEST(Penumbra, ColouredLeaves) {
  CanopyMask mask{Raster(20, 20, 3), 0.1, false};
  for (int c = 0; c < 3; ++c) {
    const CanopyMask one = noise(20, 20, 0.1, false, uint64_t(c));
    std::copy(one.transmittance.values.begin(), one.transmittance.values.end(), mask.transmittance.row(c, 0));
  }
  const SunDisc sun(0.3, 0, RGB(1, 2, 3));
  const SkyDome sky = SkyDome::uniform() * RGB(4, 5, 6);
  const CanopyPlane plane{mask, 2};
  const Raster all = ground_irradiance(std::span(&plane, 1), sun, sky);
  for (int c = 0; c < 3; ++c) {
    const CanopyPlane one{noise(20, 20, 0.1, false, uint64_t(c)), 2};
    const Raster grey = ground_irradiance(std::span(&one, 1), sun, sky);
    for (int i = 0; i < 20; ++i) EXPECT_NEAR(all.at(c, i, i), grey.at(c, i, i), 1e-5) << c;
  }
}

// Expectation: one sheet above the other: clear sheets change nothing, sheets of constants multiply, two equal
// half-open sheets merged at one height are one.
TEST(Penumbra, SeveralSheets) {
  const CanopyMask clear = mask_of(16, 16, 0.2, true, [](int, int) { return 1.0f; });
  const CanopyMask half = mask_of(16, 16, 0.2, true, [](int, int) { return 0.5f; });
  const CanopyMask leaves = noise(16, 16, 0.2, true);
  const SunDisc sun(0.4, 1, RGB(100));
  const SkyDome sky = SkyDome::cie_overcast().with_irradiance(50);
  const CanopyPlane alone[] = {{leaves, 4}}, with_clear[] = {{leaves, 4}, {clear, 9}},
                    with_half[] = {{leaves, 4}, {half, 9}};
  const Raster e = ground_irradiance(alone, sun, sky), same = ground_irradiance(with_clear, sun, sky),
               dim = ground_irradiance(with_half, sun, sky);
  const PenumbraSettings merged{.planes = Planes::merged};
  const Raster same_merged = ground_irradiance(with_clear, sun, sky, merged);
  for (size_t i = 0; i < e.values.size(); ++i) {
    EXPECT_NEAR(same.values[i], e.values[i], 1e-3);
    EXPECT_NEAR(dim.values[i], e.values[i] / 2, 1e-3);
    EXPECT_NEAR(same_merged.values[i], e.values[i], 1e-3);
  }
  const CanopyPlane odd[] = {{leaves, 4}, {noise(8, 16, 0.2, true), 9}};
  EXPECT_THROW(ground_irradiance(odd, sun, sky), std::invalid_argument);
  const CanopyPlane sunk[] = {{leaves, 0}};
  EXPECT_THROW(ground_irradiance(sunk, sun, sky), std::invalid_argument);
}

// Expectation: under an open uniform sky a surface of slope b gets (1 + cos b) / 2 of the level ground's; under leaves
// level ground gets what sky_irradiance says, within the 3 % of nine harmonics. The sun's share is exact.
TEST(Penumbra, SurfacesOfAnyOrientation) {
  const CanopyMask clear = mask_of(8, 8, 1, false, [](int, int) { return 1.0f; });
  const OrientedSkylight open(clear, 5, SkyDome::uniform());
  for (const double slope : {0.0, 30.0, 60.0, 90.0, 150.0}) {
    const V3f n(float(std::sin(slope * degree)), 0, float(std::cos(slope * degree)));
    EXPECT_NEAR(open.irradiance(3, 3, n).g, (1 + std::cos(slope * degree)) / 2, 0.035) << slope;
  }
  const CanopyMask leaves = noise(16, 16, 0.7, true);
  const SkyDome sky = SkyDome::cie_overcast();
  const OrientedSkylight under(leaves, 5, sky);
  EXPECT_NEAR(under.irradiance(4, 9, {0, 0, 1}).g, sky_irradiance(leaves, 5, sky).at(1 - 1, 4, 9), 0.03);
  const SunDisc sun(60 * degree, 0, RGB(10));
  EXPECT_NEAR(oriented_sunlight(RGB(5), sun, {1, 0, 0}).r, 5 * std::tan(60 * degree), 1e-4);
  EXPECT_EQ(oriented_sunlight(RGB(5), sun, {-1, 0, 0}).r, 0);
}

TEST(Penumbra, SameBitsForAnyNumberOfThreads) {
  const CanopyPlane plane{noise(100, 90, 0.1, false), 3};
  const SunDisc sun(0.5, 1, RGB(100));
  const SkyDome sky = SkyDome::preetham(sun.direction(), 2.5).with_irradiance(80);
  set_thread_count(1);
  const Raster one = ground_irradiance(std::span(&plane, 1), sun, sky);
  for (const int threads : {2, 4}) {
    set_thread_count(threads);
    EXPECT_EQ(ground_irradiance(std::span(&plane, 1), sun, sky).values, one.values);
  }
  set_thread_count(0);
}

TEST(Penumbra, MemoryIsBounded) {
  const CanopyMask mask = noise(64, 64, 0.1, false);
  EXPECT_THROW(sky_irradiance(mask, 2, SkyDome::uniform(), {.sky_cell = 0, .max_bytes = 1 << 16}), MemoryError);
}

}  // namespace
}  // namespace dapple::forest
