// SPDX-License-Identifier: Apache-2.0
// Distribution ray tracing on shading grids against closed forms, and against the path tracer.
#include <gtest/gtest.h>

#include "tests/integrate/distribution_scenes.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using shading::Stage;
using test::build_text;
using test::expect_near;
using test::film;
using test::furnished_room;
using test::render_built;
using test::render_text;
using test::uncached;

// As in tests/analytic: inside a sphere that emits 1 and reflects 1/2 radiance is the sum of 2^-i up to i = bounces
// + 1.
TEST(DistributionFurnace, SphereSumsTheGeometricSeries) {
  const std::string scene = film(16) + R"(Camera "spherical" "string mapping" "equirectangular"
WorldBegin
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
AreaLightSource "diffuse" "rgb L" [ 1 1 1 ]
ReverseOrientation
Shape "sphere" "float radius" 2
)";
  float expected = 1, power = 1;
  for (int b = 0; b < 4; ++b) {
    power *= .5f;
    expected += power;
    expect_near(render_text(scene, 4, uncached(b, {4}, {4})).mean(), RGB(expected), .006f,
                std::to_string(b) + " bounces");
  }
}

// Every point sends exactly the rays that the lists say: n grid points, s shadow and d diffuse rays by depth.
TEST(DistributionRays, AreThoseOfTheLists) {
  const std::string scene = film(16) + R"(Camera "spherical" "string mapping" "equirectangular"
WorldBegin
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
ReverseOrientation
Shape "sphere" "float radius" 2
LightSource "point" "rgb I" [ 1 1 1 ]
)";
  const auto r = render_text(scene, 4, uncached(2, {3, 2}, {5, 3}));
  const uint64_t all = r.result.stages[Stage::diffuselighting];
  EXPECT_EQ(r.result.stages[Stage::prelighting], all);
  // all = n (1 + 5 + 15), one shadow ray each since the light is a point; but cells that are seen send up to four, to
  // have shadows' edges as means.
  const uint64_t n = all / 21;
  EXPECT_EQ(all, n * 21);
  EXPECT_EQ(r.result.rays.diffuse, n * (5 + 15));
  EXPECT_EQ(r.result.rays.shadow, n * (3 + 5 + 15));
}

// One bar a pixel stands in the sun, half as wide and not parallel to the pixels: points in the middle of cells would
// be light or dark.
TEST(DistributionGrids, ShowTheMeanOfShadows) {
  constexpr int bars = 40, size = 20;
  std::string corners, indices;
  for (int bar = 0; bar < bars; ++bar) {
    const float x = 2 * float(bar) / bars - 1;
    for (const V2f& q : {V2f(0, -2), V2f(1.0f / bars, -2), V2f(.4f, 2), V2f(.4f + 1.0f / bars, 2)})
      corners += std::to_string(x + q.x) + " " + std::to_string(q.y) + " 1 ";
    for (int v = 0; v < 4; ++v) indices += std::to_string(4 * bar + v) + " ";
  }
  const auto built = build_text(film(size) + R"(LookAt 0 0 .5  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ -.5 .5 -.5 .5 ]
WorldBegin
LightSource "distant" "point3 from" [ .3 .2 4 ] "point3 to" [ 0 0 0 ]
Shape "bilinearmesh" "point3 P" [ -1 -1 0  1 -1 0  -1 1 0  1 1 0 ]
Shape "bilinearmesh" "point3 P" [ )" +
                                corners + "] \"integer indices\" [ " + indices + "]");
  const auto r = render_built(built, 16, uncached(0, {4}, {1}));
  const float mean = r.mean().g;
  double square = 0;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) square += sqr(r.film.pixel(x, y).g / mean - 1);
  EXPECT_LT(std::sqrt(square / (size * size)), .45);  // seen .34, from the middles of cells .78
  expect_near(r.mean(), render_built(built, 1024, test::bounces(0)).mean(), .015f, "mean");
}

// A wall in the sun runs on under a roof, wherever that meets the cells that pixels see: there it is dark.
TEST(DistributionGrids, DoNotSeeTheSunUnderRoofs) {
  constexpr int size = 20;
  for (const float roof : {.003f, .013f, .031f, .05f, .061f}) {
    const std::string y = std::to_string(roof) + " ";
    const auto built = build_text(film(size) + R"(LookAt 0 0 -.5  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ -.5 .5 -.5 .5 ]
WorldBegin
LightSource "distant" "point3 from" [ 0 1 -1 ] "point3 to" [ 0 0 0 ]
Shape "bilinearmesh" "point3 P" [ -1 -1 0  1 -1 0  -1 1 0  1 1 0 ]
Shape "bilinearmesh" "point3 P" [ -5 )" +
                                  y + "-9  5 " + y + "-9  -5 " + y + "1  5 " + y + "1 ]");
    const auto r = render_built(built, 16, uncached(0, {16}, {1}));
    for (int row = 0; row < size; ++row) {
      const float low = .5f - float(row + 1) / size, high = .5f - float(row) / size, lit = .5f / pi;
      double sum = 0;
      for (int x = 0; x < size; ++x) sum += double(r.film.pixel(x, row).g) / size;
      if (high <= roof) {
        EXPECT_LT(sum, .001 * lit) << roof << ", row " << row;
      } else if (low > roof + .01f) {
        EXPECT_NEAR(sum, lit * std::sqrt(.5f), .001 * lit) << roof << ", row " << row;
      }
    }
  }
}

// Each of the many rays of a coat is one of those that its pixel has: what they meet in turn sends fewer. Reflections
// of reflections then add little, where they would multiply: 16 rays a sample, a sixth of them reflected, at each of up
// to 16 coats.
TEST(DistributionRays, DoNotMultiplyBetweenCoats) {
  const auto built = build_text(film(8) + R"(Camera "spherical" "string mapping" "equirectangular"
WorldBegin
LightSource "point" "rgb I" [ 1 1 1 ]
Material "coateddiffuse" "rgb reflectance" [ .3 .3 .3 ] "float roughness" .3
ReverseOrientation
Shape "sphere" "float radius" 2
)");
  const auto rays = [&](int specular_depth, bool cache) {
    auto s = uncached(1, {1}, {64, 4});
    s.shading.specular_depth = specular_depth;
    s.radiosity_cache = cache;
    const auto& count = render_built(built, 4, s).result.rays;
    return double(count.diffuse + count.specular);
  };
  EXPECT_LT(rays(16, false), 1.5 * rays(1, false));
  EXPECT_LT(rays(16, true), 1.5 * rays(1, true));
}

struct Look {
  const char* name;
  const char* material;
};
void PrintTo(const Look& m, std::ostream* out) {
  *out << m.name;
}

class DistributionUnderUniformSky : public testing::TestWithParam<Look> {};

// A white object under a uniform sky shows the sky's radiance.
TEST_P(DistributionUnderUniformSky, LosslessObjectsHide) {
  const std::string scene = film(16) + R"(LookAt 0 -3 0  0 0 0  0 0 1
Camera "perspective" "float fov" 30
WorldBegin
LightSource "infinite" "rgb L" [ 1 1 1 ]
)" + GetParam().material + R"(
Shape "sphere" "float radius" 1
)";
  auto s = uncached(20, {16, 1}, {16, 1});
  s.shading.specular_depth = 200;
  expect_near(render_text(scene, 64, s).mean(), RGB(1), .012f, GetParam().name);
}
INSTANTIATE_TEST_SUITE_P(
    Materials, DistributionUnderUniformSky,
    testing::Values(
        Look{"diffuse", R"(Material "diffuse" "rgb reflectance" [ 1 1 1 ])"},
        Look{"transmission",
             R"(Material "diffusetransmission" "rgb reflectance" [ .5 .5 .5 ] "rgb transmittance" [ .5 .5 .5 ])"},
        Look{"glass", R"(Material "dielectric" "float eta" 1.5)"},
        Look{"thin", R"(Material "thindielectric" "float eta" 1.5)"},
        Look{"mirror", R"(Material "conductor" "rgb reflectance" [ 1 1 1 ] "float roughness" 0)"},
        Look{"interface", R"(Material "interface")"}),
    [](const auto& tested) { return std::string(tested.param.name); });

class DistributionAgainstPath : public testing::TestWithParam<Look> {};

// Both estimate the same integral, but for layered materials at diffuse hits (their mean albedo) and interpolation:
// within 1 % of the mean, where noise leaves .3 %.
TEST_P(DistributionAgainstPath, InARoom) {
  const auto built = build_text(furnished_room(GetParam().material));
  auto s = uncached(2, {8, 2}, {16, 2});
  s.shading.specular_depth = 8;
  const RGB mean = render_built(built, 16, s).mean();
  const RGB expected = render_built(built, 576, test::bounces(2, 8)).mean();
  expect_near(mean, expected, .01f, GetParam().name);
}

// The same with diffuse rays, and those of coats, that end in the cache. Cells in the ball's contact shadow add to the
// bias.
TEST_P(DistributionAgainstPath, InARoomWithTheCache) {
  const auto built = build_text(furnished_room(GetParam().material));
  auto s = uncached(2, {8, 2}, {64, 8});
  s.shading.specular_depth = 8;
  s.radiosity_cache = true;
  const RGB mean = render_built(built, 16, s).mean();
  const RGB expected = render_built(built, 576, test::bounces(2, 8)).mean();
  expect_near(mean, expected, .015f, GetParam().name);
}
INSTANTIATE_TEST_SUITE_P(
    Materials, DistributionAgainstPath,
    testing::Values(
        Look{"diffuse", R"(Material "diffuse" "rgb reflectance" [ .5 .5 .5 ])"},
        Look{"leaf",
             R"(Material "diffusetransmission" "rgb reflectance" [ .3 .3 .1 ] "rgb transmittance" [ .2 .4 .1 ])"},
        Look{"metal", R"(Material "conductor" "rgb reflectance" [ .9 .7 .4 ] "float roughness" .2)"},
        Look{"coated", R"(Material "coateddiffuse" "rgb reflectance" [ .6 .3 .2 ] "float roughness" .1)"},
        Look{"rough_glass", R"(Material "dielectric" "float eta" 1.3 "float roughness" .1)"},
        Look{"interface", R"(Material "interface")"}),
    [](const auto& tested) { return std::string(tested.param.name); });

// Fog around a lamp and its shadow, scattered once. The path tracer does the same where neither diffuse nor specular
// scatterings may follow.
TEST(DistributionMedia, ScatterOnce) {
  const auto built = build_text(film(32) + R"(LookAt 0 -3 1  0 0 .7  0 0 1
MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_a" [ .02 .05 .1 ] "rgb sigma_s" [ .3 .25 .2 ] "float g" .4
MediumInterface "" "fog"
Camera "perspective" "float fov" 60
WorldBegin
MediumInterface "fog" "fog"
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 20 20 20 ]
  Translate 1 -2 4
  Shape "sphere" "float radius" .5
AttributeEnd
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
Shape "bilinearmesh" "point3 P" [ -4 -4 0  4 -4 0  -4 4 0  4 4 0 ]
Shape "bilinearmesh" "point3 P" [ -.5 .5 1  .5 .5 1  -.5 1 1.1  .5 1 1.1 ]
Shape "bilinearmesh" "point3 P" [ -4 4 0  4 4 0  -4 4 4  4 4 4 ]
)");
  auto s = uncached(0, {8}, {1});
  s.shading.specular_depth = 0;
  const RGB mean = render_built(built, 256, s).mean();
  const RGB expected = render_built(built, 1024, test::bounces(0, 0)).mean();
  expect_near(mean, expected, .01f, "fog");
}

// A wall that only a floor of this material lights, which is lit by these sources.
std::string wall_above(const std::string& floor, const std::string& sources) {
  return film(12) + R"(LookAt 0 1 3  0 2 3  0 0 1
Camera "perspective" "float fov" 60
WorldBegin
MakeNamedMaterial "paint" "string type" "diffuse" "rgb reflectance" [ 0 0 0 ]
MakeNamedMaterial "varnish" "string type" "coateddiffuse" "rgb reflectance" [ 0 0 0 ] "float roughness" .01
)" + sources +
         R"(
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
Shape "bilinearmesh" "point3 P" [ -4 2 2.05  4 2 2.05  -4 2 5  4 2 5 ]
)" + floor +
         R"(
Shape "bilinearmesh" "point3 P" [ -4 -4 0  4 -4 0  -4 2 0  4 2 0 ]
)";
}

void expect_as_path_traced(const std::string& scene, int path_samples, double error, bool coat_matters) {
  const auto built = build_text(scene);
  const float expected = render_built(built, path_samples, test::bounces(1, 8)).mean().g;
  ASSERT_GT(expected, 0);
  for (const bool cache : {false, true}) {
    auto s = uncached(1, {4, 4}, {4096});
    s.radiosity_cache = cache;
    EXPECT_NEAR(render_built(built, 4, s).mean().g / expected, 1, error) << scene << cache;
    s.shading.caustics = false;
    if (coat_matters) {
      EXPECT_GT(std::abs(render_built(built, 4, s).mean().g / expected - 1), 0.1) << scene << cache;
    }
  }
}

const std::string grey_varnish = R"(Material "coateddiffuse" "rgb reflectance" [ .5 .5 .5 ] "float roughness" .01)";

// Above the lamp only what a polished black floor mirrors lights the wall: as a diffuse surface the floor would send it
// elsewhere.
TEST(DistributionCoats, MirrorWhatDiffuseRaysSee) {
  const std::string lamp = R"(AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 10 10 10 ]
  Shape "bilinearmesh" "point3 P" [ -4 -4 2  -4 1 2  4 -4 2  4 1 2 ]
AttributeEnd)";
  expect_as_path_traced(wall_above(R"(NamedMaterial "varnish")", lamp), 4096, 0.02, true);
  expect_as_path_traced(wall_above(R"(ReverseOrientation NamedMaterial "varnish")", lamp), 4096, 0.02, true);
  expect_as_path_traced(
      wall_above(R"(Material "mix" "string materials" [ "paint" "varnish" ] "float amount" .5)", lamp), 4096, 0.02,
      true);
  expect_as_path_traced(wall_above(grey_varnish, lamp), 4096, 0.04, false);
}

// A screen keeps the sun from the wall.
TEST(DistributionCoats, ShineInTheSun) {
  const std::string sun = R"(LightSource "distant" "point3 from" [ 0 -1 1 ] "point3 to" [ 0 0 0 ] "rgb L" [ 3 3 3 ]
NamedMaterial "paint"
Shape "bilinearmesh" "point3 P" [ -9 .5 3.5  9 .5 3.5  -9 .5 7  9 .5 7 ])";
  expect_as_path_traced(
      wall_above(
          R"(Material "coateddiffuse" "rgb reflectance" [ 0 0 0 ] "bool remaproughness" false "float roughness" .2)",
          sun),
      4096, 0.02, true);
  expect_as_path_traced(wall_above(grey_varnish, sun), 65536, 0.04, false);
}

// The recursion is as deep as bounces and specular depth say: they are bounded.
TEST(DistributionDepth, IsBounded) {
  const auto with = [](const std::string& parameter) {
    return build_text("Camera \"perspective\"\nIntegrator \"distribution\" " + parameter + "\nWorldBegin\n");
  };
  EXPECT_THROW(with("\"integer bounces\" 33"), InputError);
  EXPECT_THROW(with("\"integer speculardepth\" 33"), InputError);
  const auto built = with("\"integer bounces\" 32");
  EXPECT_NO_THROW(build::make_integrator(*built.scene, built.request, 1, 0));
  build::IntegratorRequest deep;
  deep.bounces = 33;
  EXPECT_THROW(build::make_integrator(*built.scene, deep.over(built.request), 1, 0), UsageError);
}

// Mixed materials by random choice are resolved by samples, and by blending where both are diffuse.
TEST(DistributionMix, IsTheMean) {
  const std::string scene = film(8) + R"(LookAt 0 0 1  0 0 0  0 1 0
Camera "orthographic"
WorldBegin
LightSource "infinite" "rgb L" [ 1 1 1 ]
MakeNamedMaterial "white" "string type" "diffuse" "rgb reflectance" [ 1 1 1 ]
MakeNamedMaterial "black" "string type" "diffuse" "rgb reflectance" [ 0 0 0 ]
MakeNamedMaterial "mirror" "string type" "conductor" "rgb reflectance" [ 1 1 1 ] "float roughness" 0
Material "mix" "string materials" [ "white" "OTHER" ] "float amount" .25
Shape "bilinearmesh" "point3 P" [ -1 -1 0  1 -1 0  -1 1 0  1 1 0 ]
)";
  auto with = [&](const std::string& other) {
    std::string text = scene;
    text.replace(text.find("OTHER"), 5, other);
    return render_text(text, 64, uncached(0, {16}, {1}));
  };
  const auto blended = with("black");
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 8; ++x) EXPECT_NEAR(blended.film.pixel(x, y).r, .75f, .01f);
  expect_near(with("mirror").mean(), RGB(1), .02f, "white and mirror");
}

// A wall inside a medium that its directive names is lit through that medium, wherever the camera is.
TEST(DistributionMedia, SurfacesKnowTheirMedium) {
  const auto built = build_text(film(16) + R"(LookAt 0 0 4  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ -.3 .3 -.3 .3 ]
MakeNamedMedium "ink" "string type" "homogeneous" "rgb sigma_a" [ 1 1 1 ] "rgb sigma_s" [ 0 0 0 ]
WorldBegin
LightSource "distant" "point3 from" [ 0 0 1 ] "point3 to" [ 0 0 0 ] "rgb L" [ 3 3 3 ]
AttributeBegin
  MediumInterface "ink" ""
  Material "interface"
  Shape "sphere" "float radius" 1
AttributeEnd
MediumInterface "ink" "ink"
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
Shape "bilinearmesh" "point3 P" [ -.5 -.5 0  .5 -.5 0  -.5 .5 0  .5 .5 0 ]
)");
  expect_near(render_built(built, 16, uncached(0, {1}, {1})).mean(), render_built(built, 64, test::bounces(0)).mean(),
              .01f, "ink");
}

}  // namespace
}  // namespace dapple
