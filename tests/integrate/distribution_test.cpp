// SPDX-License-Identifier: Apache-2.0
// Distribution ray tracing on shading grids against closed forms, against the path tracer, and against itself: what is
// shaded how often.
#include <gtest/gtest.h>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"
#include "dapple/numeric/warp.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using distribution::DistributionIntegrator;
using integrate::RayList;
using shading::Stage;
using test::build_text;
using test::expect_near;
using test::render_built;
using test::render_text;
using test::same_bits;

DistributionIntegrator::Settings settings(int bounces, RayList shadow, RayList diffuse) {
  DistributionIntegrator::Settings s;
  s.radiosity_cache = false;
  s.shading.bounces = bounces;
  s.shading.shadow_rays = std::move(shadow);
  s.shading.diffuse_rays = std::move(diffuse);
  return s;
}

std::string film(int size) {
  const std::string n = std::to_string(size);
  return "Film \"rgb\" \"integer xresolution\" " + n + " \"integer yresolution\" " + n + "\nPixelFilter \"box\"\n";
}

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
    expect_near(render_text(scene, 4, settings(b, {4}, {4})).mean(), RGB(expected), .006f,
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
  const auto r = render_text(scene, 4, settings(2, {3, 2}, {5, 3}));
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
  const auto r = render_built(built, 16, settings(0, {4}, {1}));
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
    const auto r = render_built(built, 16, settings(0, {16}, {1}));
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
    auto s = settings(1, {1}, {64, 4});
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
  auto s = settings(20, {16, 1}, {16, 1});
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

// A room with everything in it, by both integrators.
std::string room(const std::string& material) {
  return film(48) + R"(LookAt 0 -3.2 1.2  0 0 .8  0 0 1
Camera "perspective" "float fov" 50
WorldBegin
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 12 11 9 ]
  Shape "bilinearmesh" "point3 P" [ -.4 -.4 1.98  -.4 .4 1.98  .4 -.4 1.98  .4 .4 1.98 ]
AttributeEnd
Texture "checks" "spectrum" "checkerboard" "float uscale" 6 "float vscale" 6 "rgb tex1" [ .8 .7 .3 ] "rgb tex2" [ .1 .2 .4 ]
Material "diffuse" "texture reflectance" "checks"
Shape "trianglemesh" "point3 P" [ -2 -4 0  2 -4 0  2 2 0  -2 2 0 ] "point2 uv" [ 0 0  1 0  1 1  0 1 ] "integer indices" [ 0 1 2  0 2 3 ]
Material "diffuse" "rgb reflectance" [ .6 .6 .6 ]
Shape "bilinearmesh" "point3 P" [ -2 2 0  2 2 0  -2 2 2  2 2 2 ]
Shape "bilinearmesh" "point3 P" [ -2 -4 2  2 -4 2  -2 2 2  2 2 2 ]
Material "diffuse" "rgb reflectance" [ .7 .1 .1 ]
Shape "bilinearmesh" "point3 P" [ -2 -4 0  -2 2 0  -2 -4 2  -2 2 2 ]
Shape "bilinearmesh" "point3 P" [ 2 -4 0  2 2 0  2 -4 2  2 2 2 ]
)" + material +
         R"(
ObjectBegin "ball"
Shape "sphere" "float radius" .5
ObjectEnd
Translate -.7 .6 .5
ObjectInstance "ball"
Translate 1.4 0 0
Scale 1 1 .8
ObjectInstance "ball"
)";
}

class DistributionAgainstPath : public testing::TestWithParam<Look> {};

// Both estimate the same integral, but for layered materials at diffuse hits (their mean albedo) and interpolation:
// within 1 % of the mean, where noise leaves .3 %.
TEST_P(DistributionAgainstPath, InARoom) {
  const auto built = build_text(room(GetParam().material));
  auto s = settings(2, {8, 2}, {16, 2});
  s.shading.specular_depth = 8;
  const RGB mean = render_built(built, 16, s).mean();
  const RGB expected = render_built(built, 576, test::bounces(2, 8)).mean();
  expect_near(mean, expected, .01f, GetParam().name);
}

// The same with diffuse rays, and those of coats, that end in the cache. Cells in the ball's contact shadow add to the
// bias.
TEST_P(DistributionAgainstPath, InARoomWithTheCache) {
  const auto built = build_text(room(GetParam().material));
  auto s = settings(2, {8, 2}, {64, 8});
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
  auto s = settings(0, {8}, {1});
  s.shading.specular_depth = 0;
  const RGB mean = render_built(built, 256, s).mean();
  const RGB expected = render_built(built, 1024, test::bounces(0, 0)).mean();
  expect_near(mean, expected, .01f, "fog");
}

TEST(DistributionGrids, OfAnyNumberOfThreadsAndAnyBudgetAreTheSame) {
  const auto built = build_text(room(R"(Material "coateddiffuse" "texture reflectance" "checks" "float roughness" 0)"));
  auto s = settings(1, {2}, {3});
  const auto whole = render_built(built, 4, s);
  set_thread_count(1);
  const auto alone = render_built(built, 4, s);
  s.grid_bytes = 0;
  const auto unkept = render_built(built, 4, s);
  set_thread_count(0);
  s.grid_bytes = 100000;
  const auto few = render_built(built, 4, s);
  EXPECT_TRUE(same_bits(whole.film, alone.film));
  EXPECT_TRUE(same_bits(whole.film, unkept.film));
  EXPECT_TRUE(same_bits(whole.film, few.film));
  EXPECT_GT(unkept.result.stages[Stage::prelighting], whole.result.stages[Stage::prelighting]);
}

// Meshes much finer than a pixel, by one point for a group: leaves that turn anywhere, lit from the viewer, and a
// flattened instance of a bumpy sheet. Shading one side for the other, or groups of the wrong size, would be wrong by
// tens of per cent.
TEST(DistributionGroups, LookLikeTheirPatches) {
  std::string leaves, sheet, indices;
  KeyedRng rng(1);
  const auto number = [&](float low, float high) { return std::to_string(low + (high - low) * rng.next()) + " "; };
  const auto triple = [](const V3f& p) {
    return std::to_string(p.x) + " " + std::to_string(p.y) + " " + std::to_string(p.z) + " ";
  };
  for (int leaf = 0; leaf < 4000; ++leaf) {
    const V3f n = normalize(square_to_sphere(V2f(rng.next(), rng.next())));
    V3f s, t;
    coordinate_system(n, &s, &t);
    const V3f c(2 * rng.next() - 1, 2 * rng.next() - 1, 2 * rng.next() - 1);
    for (const V2f& q : {V2f(-1, -1), V2f(1, -1), V2f(-1, 1), V2f(1, 1)})
      leaves += triple(c + (s * q.x + t * q.y) * 0.012f);
    for (int v = 0; v < 4; ++v) indices += std::to_string(4 * leaf + v) + " ";
  }
  const std::string head = film(20) + R"(LookAt 0 0 4  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ -.8 .8 -.8 .8 ]
WorldBegin
LightSource "distant" "point3 from" [ 0 0 1 ] "point3 to" [ 0 0 0 ] "rgb L" [ 3 3 3 ]
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
)";
  const auto compare = [&](const std::string& shapes, float tolerance, const std::string& what) {
    const auto built = build_text(head + shapes);
    auto s = settings(0, {1}, {1});
    s.shading_rate = 4;
    expect_near(render_built(built, 64, s).mean(), render_built(built, 256, test::bounces(0)).mean(), tolerance, what);
  };
  // Which leaf stands for many is not which of them is seen most: some per cent.
  compare("Shape \"bilinearmesh\" \"point3 P\" [ " + leaves + "] \"integer indices\" [ " + indices + "]", .1f,
          "leaves");
  std::string grid, quads;
  constexpr int n = 60;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i)
      grid += std::to_string(2.0f * float(i) / n - 1) + " " + std::to_string(2.0f * float(j) / n - 1) + " " +
              number(0, .01f);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i)
      for (const int v : {j * (n + 1) + i, j * (n + 1) + i + 1, (j + 1) * (n + 1) + i, (j + 1) * (n + 1) + i + 1})
        quads += std::to_string(v) + " ";
  const std::string mesh = "Shape \"bilinearmesh\" \"point3 P\" [ " + grid + "] \"integer indices\" [ " + quads + "]\n";
  compare("ObjectBegin \"s\"\n" + mesh + "ObjectEnd\nScale 1 1 1e-4\nObjectInstance \"s\"", .01f, "flattened");
  compare(mesh, .02f, "sheet");
}

// Of a patch of four by four points three columns are behind another one: these are shaded as far as what is seen lies
// between them and the fourth.
TEST(DistributionGrids, OfSmallPatchesOnlyWhatIsSeenIsShaded) {
  const auto points = [](const std::string& shapes) {
    const auto built = build_text(film(8) + R"(LookAt 0 0 4  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ -4 4 -4 4 ]
WorldBegin
LightSource "infinite"
Material "diffuse"
)" + shapes);
    return render_built(built, 64, settings(0, {1}, {1})).result.stages[Stage::prelighting];
  };
  const std::string small = "Shape \"bilinearmesh\" \"point3 P\" [ -2 -2 0  2 -2 0  -2 2 0  2 2 0 ]\n";
  const std::string large = "Shape \"bilinearmesh\" \"point3 P\" [ -19 -16 1  13 -16 1  -19 16 1  13 16 1 ]\n";
  const std::string cover = "Translate -12 0 0\n" + large;
  EXPECT_EQ(points(small), 16u);
  EXPECT_EQ(points(small + cover) - points(cover), 8u);
}

// Leaves with sides of .1 in a box of 2: a mesh of quads.
std::string cloud_of_leaves(int count) {
  std::string leaves, indices;
  KeyedRng rng(2);
  for (int leaf = 0; leaf < count; ++leaf) {
    const V3f n = normalize(square_to_sphere(V2f(rng.next(), rng.next())));
    V3f s, t;
    coordinate_system(n, &s, &t);
    const V3f c(2 * rng.next() - 1, 2 * rng.next() - 1, 2 * rng.next() - 1);
    for (const V2f& q : {V2f(-1, -1), V2f(1, -1), V2f(-1, 1), V2f(1, 1)})
      for (int axis = 0; axis < 3; ++axis) leaves += std::to_string((c + (s * q.x + t * q.y) * 0.05f)[axis]) + " ";
    for (int v = 0; v < 4; ++v) indices += std::to_string(4 * leaf + v) + " ";
  }
  return "Shape \"bilinearmesh\" \"point3 P\" [ " + leaves + "] \"integer indices\" [ " + indices + "]\n";
}

// Hundreds of leaves in a pixel: only those that its first samples see, two sides of them, are shaded, whatever the
// number of samples; the image's mean stays, and it does not depend on threads or on what the store of grids forgets.
TEST(DistributionGroups, OfAPixelAreShadedFewTimes) {
  const auto built = build_text(film(8) + R"(LookAt 0 0 4  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ -.8 .8 -.8 .8 ]
WorldBegin
LightSource "distant" "point3 from" [ 1 0 1 ] "point3 to" [ 0 0 0 ] "rgb L" [ 3 3 3 ]
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
)" + cloud_of_leaves(3000));
  auto s = settings(0, {1}, {1});
  s.pixel_points = 0;
  const auto all = render_built(built, 256, s);
  s.pixel_points = 4;
  const auto few = render_built(built, 256, s);
  const uint64_t pixels = 64;
  EXPECT_GT(all.result.stages[Stage::prelighting], 10 * pixels);
  EXPECT_LT(few.result.stages[Stage::prelighting], 6 * pixels);
  // A few dark or bright leaves of about 4 x 64 change it by some per cent.
  expect_near(few.mean(), all.mean(), .05f, "four points");
  // As many as there are: what stands for others are all that the pixel sees.
  s.pixel_points = 128;
  expect_near(render_built(built, 256, s).mean(), all.mean(), .01f, "128 points");

  s.pixel_points = 4;
  s.grid_bytes = 0;
  set_thread_count(1);
  const auto again = render_built(built, 256, s);
  set_thread_count(0);
  EXPECT_TRUE(same_bits(few.film, again.film));
}

// The leaves of a pixel send between them about as many rays as the one point of a wall would; those that are larger
// than pixels send all of them.
TEST(DistributionGroups, OfAPixelShareItsRays) {
  const auto render = [](const std::string& half, int pixel_points) {
    const auto built = build_text(film(8) + R"(LookAt 0 0 4  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ )" +
                                  "-" + half + " " + half + " -" + half + " " + half + R"( ]
WorldBegin
LightSource "infinite" "rgb L" [ 1 1 1 ]
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
)" + cloud_of_leaves(3000));
    auto s = settings(0, {64}, {1});
    s.pixel_points = pixel_points;
    return render_built(built, 64, s);
  };
  const uint64_t pixels = 64;
  const auto points = [](const auto& r) { return r.result.stages[Stage::prelighting]; };
  const auto many = render(".8", 16), one = render(".8", 1), close = render(".1", 16);
  EXPECT_GT(points(many), 8 * pixels);
  EXPECT_LT(many.result.rays.shadow, 2 * 64 * pixels);
  EXPECT_GT(many.result.rays.shadow, 64 * pixels / 2);
  EXPECT_EQ(one.result.rays.shadow, 64 * points(one));
  EXPECT_GT(close.result.rays.shadow, 64 * points(close) / 2);
  expect_near(many.mean(), one.mean(), .05f, "sixteen points, and one");
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
    auto s = settings(1, {4, 4}, {4096});
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
    return render_text(text, 64, settings(0, {16}, {1}));
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
  expect_near(render_built(built, 16, settings(0, {1}, {1})).mean(), render_built(built, 64, test::bounces(0)).mean(),
              .01f, "ink");
}

// A wall that fills the image has no silhouette at which more samples could find more: 4 x 4 tiles of cells one pixel
// large.
TEST(DistributionGrids, AreShadedOnceHoweverManySamplesSeeThem) {
  const std::string scene = film(64) + R"(LookAt 0 0 1  0 0 0  0 1 0
Camera "orthographic"
WorldBegin
LightSource "point" "rgb I" [ 1 1 1 ] "point3 from" [ 0 0 1 ]
Material "diffuse"
Shape "bilinearmesh" "point3 P" [ -1 -1 0  1 -1 0  -1 1 0  1 1 0 ]
)";
  const auto few = render_text(scene, 4, settings(0, {1}, {1})), many = render_text(scene, 64, settings(0, {1}, {1}));
  EXPECT_EQ(few.result.stages[Stage::prelighting], 64u * 64u);
  EXPECT_EQ(many.result.stages[Stage::prelighting], 64u * 64u);
  auto coarse = settings(0, {1}, {1});
  coarse.shading_rate = 16;
  EXPECT_EQ(render_text(scene, 4, coarse).result.stages[Stage::prelighting], 16u * 16u);
}

// Slats much narrower than a pixel: each sample finds a few that none before it met. Expectation: their patterned
// shader runs in batches of 256 all the same, but for one in each of the seven passes and one where a list is full; by
// sample and block of pixels it would be hundreds.
TEST(DistributionGrids, OfManySamplesAreShadedInFullBatches) {
  std::string slats, indices;
  for (int i = 0; i < 3000; ++i) {
    const double x = -1 + 2 * i / 3000.0;
    for (const char* end : {" -1 0 ", " 1 0 "}) slats += std::to_string(x) + end + std::to_string(x + 0.5 / 3000) + end;
    for (int c = 0; c < 4; ++c) indices += std::to_string(4 * i + c) + " ";
  }
  const auto built = build_text(film(64) + R"(LookAt 0 0 1  0 0 0  0 1 0
Camera "orthographic"
WorldBegin
LightSource "point" "rgb I" [ 1 1 1 ] "point3 from" [ 0 0 1 ]
Texture "noise" "float" "fbm"
Texture "color" "spectrum" "scale" "texture scale" "noise" "rgb tex" [ .5 .5 .5 ]
Material "diffuse" "texture reflectance" "color"
Shape "bilinearmesh" "integer indices" [ )" +
                                indices + "] \"point3 P\" [ " + slats + "]\n");
  auto s = settings(0, {1}, {1});
  s.pixel_points = 0;
  set_thread_count(1);
  const auto r = render_built(built, 64, s);
  set_thread_count(0);
  const uint64_t points = r.result.stages[Stage::prelighting];
  EXPECT_GT(points, 20000u);
  EXPECT_LE(r.result.stages.batches, points / 240 + 30);
}

// One thread has claimed all points and put them off, for want of a full batch, and is not called again: what another
// thread renders of the same points must not wait for it, however much there is.
TEST(DistributionGrids, ThatAnIdleThreadHasClaimedAreShadedByWhoNeedsThem) {
  const auto built = build_text(film(16) + R"(LookAt 0 0 1  0 0 0  0 1 0
Camera "orthographic"
WorldBegin
LightSource "distant" "point3 from" [ 0 0 1 ] "point3 to" [ 0 0 0 ] "rgb L" [ 3.14159265 3.14159265 3.14159265 ]
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
Shape "bilinearmesh" "point3 P" [ -1 -1 0  1 -1 0  -1 1 0  1 1 0 ]
)");
  const DistributionIntegrator integrator(*built.scene, settings(0, {1}, {1}));
  std::unique_ptr<integrate::Integrator::Workspace> workspaces[] = {integrator.make_workspace(),
                                                                    integrator.make_workspace()};
  scene::Film image(built.scene->film);
  const Box2i all(V2i(0, 0), V2i(16, 16));
  integrator.render({all, 0, 1}, *workspaces[0], image);
  EXPECT_EQ(workspaces[0]->stages[Stage::prelighting], 0u) << "the test is to have points that are put off";
  integrator.render({all, 1, 64}, *workspaces[1], image);
  EXPECT_EQ(workspaces[1]->stages[Stage::prelighting], 16u * 16u);
  integrator.finish(workspaces, image);
  EXPECT_EQ(workspaces[0]->stages[Stage::prelighting], 0u);
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x)
      expect_near(image.pixel(x, y), RGB(.5f), 1e-5f, "pixel " + std::to_string(x) + ", " + std::to_string(y));
}

}  // namespace
}  // namespace dapple
