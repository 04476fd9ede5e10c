// SPDX-License-Identifier: Apache-2.0
// Penumbras in place of shadow rays on far ground, against the rays that they stand for.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "dapple/base/hash.h"
#include "dapple/vegetation/ground_survey.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using distribution::DistributionIntegrator;
using test::build_text;
using test::render_built;
using test::same_bits;

constexpr char level[] = "-9 -9 0  9 -9 0  -9 9 0  9 9 0", slope[] = "-9 -9 -1.8  9 -9 1.8  -9 9 -1.8  9 9 1.8";

/// Ground 4 m wide from above, and leaves of .6 m at random places up to `depth` above 2.5 m.
std::string scene(const std::string& ground, float depth, const std::string& light) {
  std::string text = R"(LookAt 0 0 2  0 0 0  0 1 0 Camera "orthographic" "float screenwindow" [ -2 2 -2 2 ]
Film "rgb" "integer xresolution" [ 64 ] "integer yresolution" [ 64 ] PixelFilter "box"
WorldBegin
)" + light + R"(
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
Shape "bilinearmesh" "point3 P" [ )" +
                     ground + " ]\n";
  KeyedRng rng(5);
  for (int i = 0; i < 60; ++i) {
    const float x = rng.next() * 8 - 4, y = rng.next() * 8 - 4, z = 2.5f + depth * rng.next();
    text += fmt::format("Shape \"bilinearmesh\" \"point3 P\" [ {0} {1} {2}  {3} {1} {2}  {0} {4} {2}  {3} {4} {2} ]\n",
                        x, y, z, x + 0.6f, y + 0.6f);
  }
  return text;
}

DistributionIntegrator::Settings direct_light(int shadow_rays) {
  DistributionIntegrator::Settings s;
  s.radiosity_cache = false;
  s.shading.bounces = 0;
  s.shading.shadow_rays = {shadow_rays};
  return s;
}

std::shared_ptr<const forest::GroundVisibility> far_ground(const scene::Scene& s, float nearest, float pixel = 0.02f) {
  return std::make_shared<forest::GroundVisibility>(vegetation::survey_ground(s, {nearest, pixel}), nullptr);
}

struct Case {
  const char* name;
  const char* ground;
  float depth;
  const char* light;
  double block;  ///< bound
};
void PrintTo(const Case& c, std::ostream* out) {
  *out << c.name;
}

class FarGround : public testing::TestWithParam<Case> {};

// Rationale: a sheet's penumbra is exact, and a deep canopy's is so for the sun, whose shadows are put where they fall
// (illumination under trees, 3; forest/penumbra.h). Expectation: the mean within 1 % of rays, and RMS of means of 8 x 8
// pixels as the case says: of half a metre, with edges within some of the ground's pixels of 2 cm.
TEST_P(FarGround, HasTheShadowsOfRays) {
  const Case& c = GetParam();
  const auto built = build_text(scene(c.ground, c.depth, c.light));
  auto settings = direct_light(256);
  const auto rays = render_built(built, 4, settings);
  settings.far_ground = far_ground(*built.scene, 1);
  const auto penumbras = render_built(built, 4, settings);
  EXPECT_EQ(penumbras.result.rays.shadow, 0u);
  EXPECT_GT(penumbras.result.rays.mask, 0u);
  const double mean = double(rays.mean().g);
  EXPECT_NEAR(double(penumbras.mean().g), mean, 0.01 * mean);
  double squares = 0;
  for (int y = 0; y < 64; y += 8)
    for (int x = 0; x < 64; x += 8) {
      double difference = 0;
      for (int k = 0; k < 64; ++k)
        difference +=
            double(penumbras.film.pixel(x + k % 8, y + k / 8).g) - double(rays.film.pixel(x + k % 8, y + k / 8).g);
      squares += sqr(difference / 64 / mean);
    }
  EXPECT_LT(std::sqrt(squares / 64), c.block);
}

constexpr char sun[] = R"(LightSource "sky" "float sunzenith" 40 "float sunazimuth" 30 "float sunirradiance" 6 )";
constexpr char low_sun[] = R"(LightSource "sky" "float sunzenith" 65 "float sunazimuth" 200 "float sunirradiance" 6 )";
constexpr char distant[] = R"(LightSource "distant" "point3 from" [ -1 2 3 ] "point3 to" [ 0 0 0 ] "float scale" 3 )";
constexpr char sky[] = R"(LightSource "infinite" "rgb L" [ .5 .7 1 ] )";
constexpr char clear_sky[] =
    R"(LightSource "sky" "string skymodel" "clear" "float sunzenith" 40 "float sunazimuth" 30 "float sunirradiance" 3 "float skyirradiance" 3 )";

INSTANTIATE_TEST_SUITE_P(
    All, FarGround,
    testing::Values(Case{"sheet_sun", level, 0, sun, 0.03}, Case{"sheet_low_sun", level, 0, low_sun, 0.03},
                    Case{"sheet_distant", level, 0, distant, 0.05}, Case{"sheet_sky", level, 0, sky, 0.02},
                    Case{"sheet_clear_sky", level, 0, clear_sky, 0.03}, Case{"slope_sun", slope, 0, sun, 0.03},
                    Case{"deep_sun", level, 2, sun, 0.03}, Case{"deep_sky", level, 2, sky, 0.02}),
    [](const auto& test) { return std::string(test.param.name); });

/// A table on the ground, 1 m high and 1.2 m wide, in the middle.
const std::string table = R"(Shape "bilinearmesh" "point3 P" [ -.6 -.6 1  .6 -.6 1  -.6 .6 1  .6 .6 1 ] )";

// Rationale: ground within the distance is left to rays. Expectation: the same bits.
TEST(FarGround, LeavesWhatIsNearToRays) {
  const auto built = build_text(scene(level, 1, sun));
  auto settings = direct_light(4);
  const auto rays = render_built(built, 1, settings);
  settings.far_ground = far_ground(*built.scene, 50);
  EXPECT_TRUE(same_bits(rays.film, render_built(built, 1, settings).film));
}

// Rationale: what stands on the ground is not the ground. Expectation: the table's top, in the picture's middle, has
// the same bits as by rays; the ground around it has the table's shadow.
TEST(FarGround, LeavesWhatStandsOnItToRays) {
  const auto built = build_text(scene(level, 0.5f, sun) + table);
  auto settings = direct_light(64);
  const auto rays = render_built(built, 1, settings);
  settings.far_ground = far_ground(*built.scene, 0.5f);
  const auto penumbras = render_built(built, 1, settings);
  EXPECT_GT(penumbras.result.rays.shadow, 0u);
  EXPECT_GT(penumbras.result.rays.mask, 0u);
  for (int y = 26; y < 38; ++y)
    for (int x = 26; x < 38; ++x) EXPECT_EQ(penumbras.film.pixel(x, y).g, rays.film.pixel(x, y).g) << x << ' ' << y;
  EXPECT_NEAR(penumbras.mean().g, rays.mean().g, 0.02f * rays.mean().g);
}

// Rationale: a sun that is too low is left to rays, and is not taken for the sky that it stands in. Expectation:
// nothing is told about its direction, but about another as low; and the mean is that of rays.
TEST(FarGround, LeavesLowSunsToRays) {
  const auto built = build_text(scene(
      level, 0.5f,
      R"(LightSource "sky" "float sunzenith" 86 "float sunazimuth" 30 "float sunirradiance" 60 "float skyirradiance" 1 )"));
  auto settings = direct_light(64);
  const auto rays = render_built(built, 1, settings);
  settings.far_ground = far_ground(*built.scene, 1);
  const float z = std::cos(radians(86.0f)), xy = std::sin(radians(86.0f)), azimuth = radians(30.0f);
  EXPECT_FALSE(settings.far_ground->answers({0, 0, 0}, {0, 0, 1}, {xy * std::cos(azimuth), xy * std::sin(azimuth), z}));
  EXPECT_TRUE(settings.far_ground->answers({0, 0, 0}, {0, 0, 1}, {-xy, 0, z}));
  const auto penumbras = render_built(built, 1, settings);
  EXPECT_NEAR(penumbras.mean().g, rays.mean().g, 0.03f * rays.mean().g);
}

// Rationale: the path tracer asks the same. Expectation: means within 1 %.
TEST(FarGround, ServesThePathTracer) {
  const auto built = build_text(scene(level, 0.5f, clear_sky));
  path::PathIntegrator::Settings settings;
  settings.diffuse_bounces = 0;
  const auto rays = render_built(built, 64, settings);
  settings.far_ground = far_ground(*built.scene, 1);
  const auto penumbras = render_built(built, 64, settings);
  EXPECT_GT(penumbras.result.rays.mask, 0u);
  EXPECT_NEAR(penumbras.mean().g, rays.mean().g, 0.01f * rays.mean().g);
}

// Rationale: a box of haze around the ground and the leaves neither is ground nor shades it; light is weakened on its
// way through it. Expectation: the mean within 1 % of rays.
TEST(FarGround, LiesInMediaThatEnd) {
  const std::string medium = R"(
MakeNamedMedium "haze" "string type" "homogeneous" "rgb sigma_s" [ 0 0 0 ] "rgb sigma_a" [ .1 .2 .05 ]
MediumInterface "" "haze"
)";
  const std::string box = R"(
AttributeBegin Material "interface" MediumInterface "haze" "" Shape "trianglemesh" "point3 P" [
 -8 -8 -1  8 -8 -1  8 8 -1  -8 8 -1  -8 -8 6  8 -8 6  8 8 6  -8 8 6 ] "integer indices" [
 0 2 1 0 3 2  4 5 6 4 6 7  0 1 5 0 5 4  1 2 6 1 6 5  2 3 7 2 7 6  3 0 4 3 4 7 ] AttributeEnd
)";
  auto settings = direct_light(64);
  const float clear = render_built(build_text(scene(level, 0.5f, sun)), 1, settings).mean().g;
  const auto built = build_text(medium + scene(level, 0.5f, sun + box));
  const auto rays = render_built(built, 1, settings);
  settings.far_ground = far_ground(*built.scene, 1);
  const auto penumbras = render_built(built, 1, settings);
  EXPECT_GT(penumbras.result.rays.mask, 1000u);
  EXPECT_LT(rays.mean().g, 0.5f * clear);
  EXPECT_NEAR(penumbras.mean().g, rays.mean().g, 0.01f * rays.mean().g);
}

// Rationale: scenes without ground, without anything above it, without light from above, and those wider than the most
// pixels are no errors. Expectation: no pixels or no light; open ground is fully lit; at a cut, what is within reach of
// what was not looked at is left out.
TEST(FarGround, TakesWhatThereIs) {
  const std::string head = "LookAt 0 0 9  0 0 0  0 1 0 Camera \"perspective\" WorldBegin ";
  EXPECT_TRUE(vegetation::survey_ground(*build_text(head + sun).scene, {1, 0}).height.values.empty());
  const auto dark = build_text(scene(level, 0, R"(LightSource "point" "point3 from" [ 0 0 2 ])"));
  const auto light = vegetation::survey_ground(*dark.scene, {1, 0.1f});
  EXPECT_TRUE(light.empty());
  const auto open = build_text(head + sun + "Shape \"bilinearmesh\" \"point3 P\" [ -9 -9 0  9 -9 0  -9 9 0  9 9 0 ]");
  EXPECT_TRUE(vegetation::survey_ground(*open.scene, {1, 0}).height.values.empty());

  const auto fine = vegetation::survey_ground(*build_text(scene(level, 0, sun)).scene, {1, 1e-30f});
  EXPECT_FALSE(forest::GroundVisibility(fine, nullptr).answers({0, 0, 0}, {0, 0, 1}, {0, 0, 1}));

  const auto wide = vegetation::survey_ground(*build_text(scene(level, 0, sky)).scene, {1, 0.003f});
  EXPECT_EQ(wide.height.width, 4096);
  EXPECT_TRUE(std::isnan(wide.height.row(0, 2048)[0]));
  EXPECT_FALSE(forest::GroundVisibility(wide, nullptr).answers({wide.area.min.x + 0.01f, 0, 0}, {0, 0, 1}, {0, 0, 1}));
  EXPECT_TRUE(forest::GroundVisibility(wide, nullptr).answers({0, 0, 0}, {0, 0, 1}, {0, 0, 1}));
}

}  // namespace
}  // namespace dapple
