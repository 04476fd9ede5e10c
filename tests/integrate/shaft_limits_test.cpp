// SPDX-License-Identifier: Apache-2.0
// Light shafts by scan planes where eye, light and leaves stand as they seldom do, against rays.
#include <gtest/gtest.h>

#include <regex>

#include "tests/integrate/shaft_scenes.h"

namespace dapple {
namespace {

using namespace shaft_scenes;
using test::render_built;
using test::same_bits;

constexpr double most_z = 4.2;  // of 36 numbers, 1e-3 of all (Sidak)

/// The scene seen otherwise.
std::string seen(const Parts& parts, const std::string& look) {
  return std::regex_replace(hazy_scene(parts), std::regex("LookAt [^\n]*"), "LookAt " + look);
}

void expect_as_rays(const std::string& text, const char* what) {
  const auto built = build_text(text);
  auto settings = paths(3);
  const auto rays = render_built(built, 256, settings);
  settings.shafts = planes_of(built);
  ASSERT_TRUE(settings.shafts) << what;
  const auto planes = render_built(built, 64, settings);
  EXPECT_LT(worst_z(rays.film, planes.film, 0.005), most_z) << what;
  EXPECT_EQ(planes.film.dropped_samples(), 0u) << what;
  EXPECT_GT(planes.mean().g, 0) << what;
}

// Expectation: with the sun in the picture, by a point and by a disc, what rays show.
TEST(ShaftLimits, LookingIntoTheSun) {
  expect_as_rays(seen({.lights = std::string(sun) + sky}, "0 -6 1.5  -4 -1 7.5  0 0 1"), "point");
  expect_as_rays(seen({.lights = disc, .bounded = true}, "0 -6 1.5  -.17 -5.02 2.5  0 0 1"), "disc");
}

// Rationale: an eye inside a crown has leaves on all sides, nearer than any bin is wide; one inside an object sees
// light through its cracks alone. Expectation: what rays show.
TEST(ShaftLimits, EyeInsideACrown) {
  std::string crown;
  KeyedRng rng(21);
  const auto point = [&rng](const V3f& at, float size) {
    const V3f p = at + V3f(rng.next() - 0.5f, rng.next() - 0.5f, rng.next() - 0.5f) * size;
    return fmt::format("{} {} {} ", p.x, p.y, p.z);
  };
  for (int i = 0; i < 150; ++i) {
    const V3f at = V3f(0, -6, 1.5f) + V3f(rng.next() - 0.5f, rng.next() - 0.5f, rng.next() - 0.5f) * 1.6f;
    crown += "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point3 P\" [ " + point(at, 0.3f) +
             point(at, 0.3f) + point(at, 0.3f) + "]\n";
  }
  expect_as_rays(hazy_scene({.lights = std::string(sun) + sky}) + crown, "crown");
  const std::string barrel = R"(AttributeBegin Translate 0 -6 1 Shape "cylinder" "float radius" .8 "float zmin" -.9
"float zmax" .9 AttributeEnd )";
  expect_as_rays(hazy_scene({.lights = std::string(sun) + sky}) + barrel, "barrel");
}

// Rationale: a sun below the horizon lights the air from below where no ground is in the way. Expectation: nothing
// through layered haze, whose depth has no end downwards; in a box that is wider than the ground what rays show.
TEST(ShaftLimits, SunBelowTheHorizon) {
  const std::string low = R"(LightSource "distant" "point3 from" [ -4 5 -3 ] "point3 to" [ 0 0 0 ] "rgb L" [ 4 4 4 ] )";
  const auto built = build_text(hazy_scene({.lights = low}));
  auto settings = paths(3);
  settings.shafts = planes_of(built);
  ASSERT_TRUE(settings.shafts);
  const auto planes = render_built(built, 4, settings);
  EXPECT_EQ(planes.film.dropped_samples(), 0u);
  EXPECT_EQ(planes.mean().max(), 0);
  const std::regex ground("-30 -30 0  30 -30 0  -30 30 0  30 30 0");
  const std::string in_box = hazy_scene({.medium = homogeneous, .lights = low, .bounded = true});
  expect_as_rays(std::regex_replace(in_box, ground, "-3 -3 0  3 -3 0  -3 3 0  3 3 0"), "box");
}

// Expectation: two suns and a spot at once, each as by rays; four suns take four times the memory of one, at most.
TEST(ShaftLimits, SeveralLights) {
  const std::string second =
      R"(LightSource "distant" "point3 from" [ 5 3 4 ] "point3 to" [ 0 0 0 ] "rgb L" [ 1 2 4 ] )";
  expect_as_rays(hazy_scene({.lights = sun + second + spot, .bounded = true}), "two suns and a spot");
  const auto bytes = [](const std::string& lights) {
    return planes_of(build_text(hazy_scene({.lights = lights})))->tables().bytes;
  };
  std::string four = sun + second;
  four += R"(LightSource "distant" "point3 from" [ 1 1 4 ] "point3 to" [ 0 0 0 ] )";
  four += R"(LightSource "distant" "point3 from" [ -1 3 4 ] "point3 to" [ 0 0 0 ] )";
  EXPECT_LE(bytes(four), 4 * bytes(sun) + bytes(sun) / 4);
}

// Rationale: leaves that let some light through by chance, and light of some colours. Expectation: means within 1 % a
// channel.
TEST(ShaftLimits, CutOutAndColouredLeaves) {
  for (const std::string& opacity : {std::string("\"float alpha\" .5"), std::string("\"rgb opacity\" [ .2 .9 .5 ]")}) {
    const std::string text = std::regex_replace(hazy_scene({.lights = sun}),
                                                std::regex("(Shape \"bilinearmesh\") (\"point3 P\" \\[ -?[0-9]\\.)"),
                                                "$1 " + opacity + " $2");
    ASSERT_NE(text, hazy_scene({.lights = sun}));
    const auto built = build_text(text);
    auto settings = paths(1);
    const RGB rays = render_built(built, 1024, settings).mean();
    settings.shafts = planes_of(built);
    ASSERT_TRUE(settings.shafts);
    test::expect_near(render_built(built, 128, settings).mean(), rays, 0.01f, opacity.c_str());
  }
}

// Rationale: the edge of a board 20 m above thin air, under a sun of 10 degrees, seen across its shadow. Expectation:
// the light falls off as a disc is covered by a line: the place of its fall has the deviation of the disc's points,
// half the radius 20 tan(5 degrees), to 10 %, of which 5 are by its being sixteen points.
TEST(ShaftLimits, DiscsSoftenByDistance) {
  const auto built = build_text(R"(LookAt 0 -200 0  0 0 0  0 0 1
Camera "perspective" "float fov" 3 "float screenwindow" [ -1 1 -.05 .05 ]
Film "rgb" "integer xresolution" 400 "integer yresolution" 20 PixelFilter "box"
WorldBegin
MakeNamedMedium "thin" "string type" "homogeneous" "rgb sigma_a" [ 0 0 0 ] "rgb sigma_s" [ 1e-4 1e-4 1e-4 ]
LightSource "sky" "float sunzenith" 0 "float sunirradiance" 4 "float sundiameter" 10 "bool flatsun" true
  "float skyirradiance" 0
Material "diffuse" "rgb reflectance" [ 0 0 0 ]
Shape "bilinearmesh" "point3 P" [ 0 -3 20  90 -3 20  0 3 20  90 3 20 ]
Material "interface" MediumInterface "thin" ""
Shape "trianglemesh" "integer indices" [ 0 2 1 1 2 3  4 5 6 5 7 6  0 1 4 1 5 4  2 6 3 3 6 7  0 4 2 2 4 6  1 3 5 3 7 5 ]
  "point3 P" [ -40 -.5 -1  40 -.5 -1  -40 .5 -1  40 .5 -1  -40 -.5 1  40 -.5 1  -40 .5 1  40 .5 1 ]
)");
  auto settings = paths(1);
  settings.shafts = planes_of(built, {.single = true});
  ASSERT_TRUE(settings.shafts);
  const auto r = render_built(built, 128, settings);
  const auto column = [&](int x) {
    double sum = 0;
    for (int y = 5; y < 15; ++y) sum += double(r.film.pixel(x, y).g);
    return sum;
  };
  const double pixel = 2 * 200 * std::tan(1.5 * double(pi) / 180) / 400, radius = 20 * std::tan(5 * double(pi) / 180);
  const int reach = int(1.2 * radius / pixel);
  double all = 0, first = 0, second = 0;
  for (int x = 200 - reach; x <= 200 + reach; ++x) {  // x is to the left
    const double at = (200 - x) * pixel, fall = column(x) - column(x - 1);
    all += fall, first += fall * at, second += fall * at * at;
  }
  EXPECT_EQ(column(60), 0);
  EXPECT_NEAR(all, column(399), 0.05 * column(399));
  const double mean = first / all, deviation = std::sqrt(second / all - mean * mean);
  EXPECT_NEAR(mean, 0, 0.06 * radius);
  EXPECT_NEAR(deviation, radius / 2, 0.1 * radius / 2);
}

// Expectation: pictures by groups of lights add up to the image, which is that without groups bit for bit.
TEST(ShaftLimits, LightGroupsAddUp) {
  const std::string grouped =
      std::regex_replace(std::string(sun), std::regex("\"rgb L\""), "\"string group\" \"sun\" \"rgb L\"");
  const auto built = build_text(hazy_scene({.lights = grouped + sky}));
  auto settings = paths(3);
  settings.shafts = planes_of(built);
  scene::Film::Settings with = built.scene->film;
  with.light_groups = int(built.scene->light_groups.names.size());
  ASSERT_EQ(with.light_groups, 2);
  scene::Film film(with);
  const path::PathIntegrator integrator(*built.scene, settings);
  const std::atomic<bool> interrupt{false};
  render::RenderSession(integrator, film, {.pixel_samples = 4}).run(interrupt);
  double of_sun = 0;
  for (int y = 0; y < film.height(); ++y)
    for (int x = 0; x < film.width(); ++x) {
      const RGB sum = film.light_group(x, y, 0) + film.light_group(x, y, 1);
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(sum[c], film.pixel(x, y)[c], 2e-5f * film.pixel(x, y)[c] + 1e-6f);
      of_sun += double(film.light_group(x, y, built.scene->light_groups.names[0] == "sun" ? 0 : 1).g);
    }
  EXPECT_GT(of_sun, 0);
  EXPECT_TRUE(same_bits(film, render_built(built, 4, settings).film));
}

// Expectation: a sun that is turned off has no planes, and leaves the light of others, by planes and by rays, bit for
// bit; turned on, it does not.
TEST(ShaftLimits, SunTurnedOff) {
  const std::string off = R"(LightSource "distant" "point3 from" [ -4 5 6 ] "point3 to" [ 0 0 0 ] "rgb L" [ 0 0 0 ] )";
  std::string why;
  EXPECT_FALSE(planes_of(build_text(hazy_scene({.lights = sky + off})), {}, &why));
  EXPECT_NE(why.find("no sun"), std::string::npos);
  const auto picture = [](const std::string& lights) {
    const auto built = build_text(hazy_scene({.lights = lights}));
    auto settings = paths(3);
    settings.shafts = planes_of(built);
    EXPECT_TRUE(settings.shafts);
    return render_built(built, 4, settings).film;
  };
  const std::string others = std::string(spot) + sky;
  const scene::Film without = picture(others);
  EXPECT_TRUE(same_bits(without, picture(others + off)));
  EXPECT_FALSE(same_bits(without, picture(others + sun)));
}

}  // namespace
}  // namespace dapple
