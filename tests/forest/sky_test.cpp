// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "dapple/forest/canopy_mask.h"
#include "dapple/forest/sky_dome.h"
#include "dapple/forest/sun_disc.h"
#include "dapple/forest/sun_position.h"

namespace dapple::forest {
namespace {

constexpr double pi_d = std::numbers::pi;
constexpr double degree = pi_d / 180;

TEST(SkyDome, Irradiances) {
  EXPECT_NEAR(SkyDome::uniform().irradiance().g, 1, 1e-6);
  EXPECT_NEAR(SkyDome::cie_overcast().irradiance().g, 1, 2e-5);
  EXPECT_NEAR(SkyDome::preetham(sky_direction(0.6, 2), 3).with_irradiance(70).irradiance().luminance(), 70, 1e-3);
  // CIE's overcast sky: a third of the zenith's radiance at the horizon.
  const SkyDome overcast = SkyDome::cie_overcast();
  EXPECT_NEAR(overcast.radiance({1, 0, 1e-9}).g / overcast.radiance({0, 0, 1}).g, 1.0 / 3, 1e-5);
  EXPECT_TRUE(overcast.radiance({1, 0, 0}).is_black());
  EXPECT_TRUE(overcast.radiance({0.6, 0, -0.8}).is_black());
}

// Expectation: a picture of one colour is a uniform sky; a picture keeps its directions: azimuth from +x to +y, zenith
// on top.
TEST(SkyDome, FromImages) {
  image::Image flat(32, 16, 3);
  for (float& v : flat.pixels()) v = 2;
  const SkyDome sky = SkyDome::from_image(image::EnvironmentImage(flat, std::nullopt, {}));
  EXPECT_TRUE(sky.grey());
  EXPECT_NEAR(sky.irradiance().r, 2 * pi_d, 1e-4);
  image::Image spot(32, 16, 3);
  spot.pixel(8, 4)[0] = 5;  // azimuth 95.6, zenith 50.6 degrees
  const SkyDome red = SkyDome::from_image(image::EnvironmentImage(spot, std::nullopt, {}));
  EXPECT_FALSE(red.grey());
  EXPECT_NEAR(red.radiance(sky_direction(4.5 / 16 * pi_d, 8.5 / 32 * 2 * pi_d)).r, 5, 1e-4);
  image::Image black(4, 2, 1);
  EXPECT_THROW(SkyDome::from_image(image::EnvironmentImage(black, std::nullopt, {})).with_irradiance(1),
               std::invalid_argument);
}

// Preetham, Shirley and Smits 1999: at turbidity 2.5 and 45 degrees the zenith is blue and bluer than white, brighter
// about the sun, and the horizon is whiter than the zenith. The zenith's chromaticity follows from their cubic: x =
// .2468, y = .2505 (by hand).
TEST(SkyDome, Preetham) {
  const V3d sun = sky_direction(45 * degree, 0);
  const SkyDome sky = SkyDome::preetham(sun, 2.5);
  const RGB zenith = sky.radiance({0, 0, 1}), near_sun = sky.radiance(sky_direction(40 * degree, 0)),
            horizon = sky.radiance(sky_direction(88 * degree, 2));
  EXPECT_GT(zenith.b, 1.5f * zenith.r);
  EXPECT_GT(near_sun.luminance(), 2 * zenith.luminance());
  EXPECT_LT(horizon.b / horizon.r, zenith.b / zenith.r);
  // Yz = (4.0453 T - 4.9710) tan chi - .2155 T + 2.4192 = 5.1423 tan .66322 + 1.88045, chi = (4/9 - T/120) pi / 2.
  const double chi = (4.0 / 9 - 2.5 / 120) * pi_d / 2;
  EXPECT_NEAR(zenith.luminance(), (4.0453 * 2.5 - 4.9710) * std::tan(chi) - 0.2155 * 2.5 + 2.4192, 2e-3);
  EXPECT_THROW(SkyDome::preetham(sun, 1), std::invalid_argument);
  EXPECT_THROW(SkyDome::preetham({1, 0, 0}, 3), std::invalid_argument);
}

// Expectation: the canopy solver sees the same radiance, its azimuth counted from the sun's.
// Expectation: names stand for those models; of other names, and of pictures that hold no radiance, an error.
TEST(SkyDome, ByNameAndFromPictures) {
  const V3d sun = sky_direction(0.6, 2), w = sky_direction(0.9, 1);
  const SkyDome expected[] = {SkyDome::uniform(), SkyDome::cie_overcast(), SkyDome::cie_clear(sun),
                              SkyDome::preetham(sun, 3)};
  ASSERT_EQ(std::size(SkyDome::model_names), std::size(expected));
  for (size_t i = 0; i < std::size(expected); ++i)
    EXPECT_EQ(SkyDome::model(SkyDome::model_names[i], sun, 3).radiance(w), expected[i].radiance(w)) << i;
  EXPECT_THROW(SkyDome::model("cloudy", sun, 3), std::invalid_argument);
  image::Image picture(32, 16, 3);
  EXPECT_TRUE(SkyDome::from_picture(picture, "the sky", {}).irradiance().is_black());
  for (const float bad : {-1.0f, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    picture.pixel(3, 4)[1] = bad;
    EXPECT_THROW(SkyDome::from_picture(picture, "the sky", {}), InputError) << bad;
  }
}

TEST(SkyDome, GoesIntoTheCanopySolver) {
  const double azimuth = 1.1;
  const SkyDome sky = SkyDome::preetham(sky_direction(0.7, azimuth), 4);
  const Sky other = sky.solver_sky(azimuth);
  EXPECT_FALSE(other.grey);
  for (const double mu : {0.1, 0.5, 0.9})
    for (const double phi : {0.0, 2.0, 5.0})
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(other.radiance(mu, phi, c), sky.radiance(sky_direction(std::acos(mu), azimuth + phi))[c], 1e-5);
}

// Expectation: radiance over the disc adds up to the irradiances, with and without limb darkening, and samples have
// their density.
TEST(SunDisc, RadianceAddsUp) {
  for (const LimbDarkening limb : {LimbDarkening::none, LimbDarkening::hestroffer_magnan})
    for (const double zenith : {0.0, 50.0, 85.0}) {
      const SunDisc sun(zenith * degree, 2, RGB(100, 90, 80), limb);
      double across[3] = {0, 0, 0}, level[3] = {0, 0, 0};
      const int n = 400;
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
          const V3d w = sun.sample(V2f((float(i) + 0.5f) / n, (float(j) + 0.5f) / n));
          ASSERT_NEAR(w.length(), 1, 1e-12);
          const RGB L = sun.radiance(w);
          for (int c = 0; c < 3; ++c) {
            across[c] += double(L[c]) * w.dot(sun.direction()) / sun.pdf(w) / (n * n);
            level[c] += double(L[c]) * w.z / sun.pdf(w) / (n * n);
          }
        }
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(across[c], sun.irradiance_normal()[c], 2e-3 * across[c]) << zenith;
        EXPECT_NEAR(level[c], sun.irradiance_horizontal()[c], 2e-3 * level[c]) << zenith;
      }
    }
  EXPECT_THROW(SunDisc(90 * degree, 0, RGB(1)), std::invalid_argument);
  EXPECT_THROW(SunDisc(-0.1, 0, RGB(1)), std::invalid_argument);
  EXPECT_THROW(SunDisc(0.1, 0, RGB(-1)), std::invalid_argument);
}

// Expectation: a cover over the left half leaves half, on the right hand of who faces the sun: in the south (azimuth
// -90 degrees here) that is west, -x.
TEST(SunDisc, Cover) {
  image::Image cover(2, 1, 1);
  cover.pixel(1, 0)[0] = 1;
  const SunDisc sun = SunDisc(60 * degree, -90 * degree, RGB(100)).covered(cover);
  EXPECT_NEAR(sun.irradiance_normal().g, 50, 0.1);
  const V3d middle = sky_direction(60 * degree, -90 * degree);
  const V3d west(-1, 0, 0);
  EXPECT_GT(sun.radiance((middle + west * 0.002).normalized()).g, 0);
  EXPECT_EQ(sun.radiance((middle - west * 0.002).normalized()).g, 0);
  image::Image wrong(4, 4, 1);
  wrong.pixel(1, 1)[0] = 1.5f;
  EXPECT_THROW(SunDisc(0.5, 1, RGB(1)).covered(std::move(wrong), "the cover", {}), InputError);
}

// The worked example of NREL's Solar Position Algorithm (Reda and Andreas 2004): 2003-10-17 12:30:30 MST at 39.742476
// N, 105.1786 W: azimuth 194.34024, zenith 50.11162 with refraction of .0167 degrees at that height and pressure.
// Within .02 degrees.
TEST(SunPosition, OfAnExample) {
  const SunPosition at = sun_position({39.742476, -105.1786, 2003, 10, 17, 19 + 30.0 / 60 + 30.0 / 3600});
  EXPECT_NEAR(at.zenith_deg, 50.11162 + 0.0167, 0.02);
  EXPECT_NEAR(at.compass_deg, 194.34024, 0.02);
}

// At an equinox the sun rises in the east and sets in the west; at noon of the solstices it stands 23.44 degrees from
// the equator.
TEST(SunPosition, OfSeasons) {
  const SunPosition morning = sun_position({0, 0, 2024, 3, 20, 6.2});
  EXPECT_NEAR(morning.compass_deg, 90, 1);
  double highest = 180;
  for (double hour = 11; hour < 13; hour += 0.01)
    highest = std::min(highest, sun_position({60, 0, 2024, 6, 20, hour}).zenith_deg);
  EXPECT_NEAR(highest, 60 - 23.44, 0.02);
  EXPECT_EQ(days_of_month(2000, 2), 29);
  EXPECT_EQ(days_of_month(1900, 2), 28);
  EXPECT_EQ(days_of_month(2001, 13), 0);
}

// Expectation: at the equator on an equinox the sun goes from the east over the zenith to the west, 15 degrees an hour.
TEST(SunPosition, OfPartsOfDays) {
  const auto course = sun_course({0, 0, 2024, 3, 20, -1}, 8, 16, 5);
  ASSERT_EQ(course.size(), 5u);
  for (int i = 0; i < 5; ++i) {
    const auto& [hour, sun] = course[size_t(i)];
    EXPECT_DOUBLE_EQ(hour, 8 + 2 * i);
    EXPECT_DOUBLE_EQ(sun.zenith_deg, sun_position({0, 0, 2024, 3, 20, hour}).zenith_deg);
    EXPECT_NEAR(sun.zenith_deg, std::abs(hour - 12) * 15, 2.5);  // the equation of time: at most 17 minutes
  }
  EXPECT_NEAR(course[0].sun.azimuth_deg(), 0, 1);
  EXPECT_NEAR(std::abs(course[4].sun.azimuth_deg()), 180, 1);
  ASSERT_EQ(sun_course({0, 0, 2024, 3, 20, 0}, 9, 16, 1).size(), 1u);
  EXPECT_DOUBLE_EQ(sun_course({0, 0, 2024, 3, 20, 0}, 9, 16, 1)[0].hour, 9);
  EXPECT_TRUE(is_known_day(2024, 2, 29) && is_known_day(1950, 1, 1) && is_known_day(2050, 12, 31));
  EXPECT_FALSE(is_known_day(2023, 2, 29) || is_known_day(1949, 12, 31) || is_known_day(2051, 1, 1) ||
               is_known_day(2024, 13, 1) || is_known_day(2024, 4, 0));
}

TEST(CanopyMask, RefusesWhatIsNoTransmittance) {
  image::Image image(3, 2, 1);
  image.pixel(2, 1)[0] = 1.5f;
  try {
    CanopyMask::from_image(image, 1, false, {"leaves.exr"});
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("pixel 2, 1"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("from 0 to 1"), std::string::npos);
  }
  image.pixel(2, 1)[0] = std::nanf("");
  EXPECT_THROW(CanopyMask::from_image(image, 1, false, {}), InputError);
  EXPECT_THROW(CanopyMask::from_image(image::Image(), 1, false, {}), InputError);
}

// Expectation: the map's right is +x and its top +y; outside is clear, or repeats.
TEST(CanopyMask, Places) {
  image::Image image(4, 2, 1);
  for (int i = 0; i < 8; ++i) image.pixels()[size_t(i)] = float(i) / 8;
  for (const bool periodic : {false, true}) {
    const CanopyMask mask = CanopyMask::from_image(image, 8, periodic, {});
    EXPECT_EQ(mask.at(-3.9, 1.9).g, 0);
    EXPECT_EQ(mask.at(3.9, 1.9).g, 3.0f / 8);
    EXPECT_EQ(mask.at(-3.9, -1.9).g, 4.0f / 8);
    EXPECT_EQ(mask.at(4.1, 1.9).g, periodic ? 0.0f : 1.0f);
    EXPECT_EQ(mask.at(-3.9, 2.1).g, periodic ? 0.5f : 1.0f);
    for (const double far : {1e300, double(infinity), double(std::nanf(""))}) EXPECT_LE(mask.at(far, 0).g, 1.0f);
  }
}

}  // namespace
}  // namespace dapple::forest
