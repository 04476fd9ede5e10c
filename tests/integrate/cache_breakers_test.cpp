// SPDX-License-Identifier: Apache-2.0
// Scenes that break radiosity caches, each with what it may cost.
#include <gtest/gtest.h>

#include "dapple/base/parallel.h"
#include "tests/support/cache_rooms.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using distribution::DistributionIntegrator;
using integrate::RayList;
using test::build_text;
using test::expect_near;
using test::render_built;
using test::same_bits;
using test::two_rooms;
using test::TwoRooms;

// Few rays, so that cells are wide.
DistributionIntegrator::Settings settings(int bounces, RayList diffuse_rays = {16, 4}) {
  DistributionIntegrator::Settings s;
  s.shading.bounces = bounces;
  s.shading.shadow_rays = RayList{4, 2};
  s.shading.diffuse_rays = std::move(diffuse_rays);
  return s;
}

// The mean over seeds: what is left is the cache's own error.
RGB mean_of_seeds(const build::BuiltScene& built, DistributionIntegrator::Settings s, int samples, int seeds) {
  RGB sum;
  for (int seed = 0; seed < seeds; ++seed) {
    s.shading.seed = uint64_t(seed);
    sum += render_built(built, samples, s).mean();
  }
  return sum * (1 / float(seeds));
}

struct WallCase {
  const char* name;
  TwoRooms rooms;
  float bound;  ///< of the light of the lit room that may get into the other
  int bounces = 2;
};

class Walls : public testing::TestWithParam<WallCase> {};

// One quad for both rooms must be parted where the wall stands on it; so must it where the wall is of patches
// smaller than its cells, and so must groups of patches on both sides of a wall.
// Seen: 0, 0, .025, .027, 0 and .096 %, where it was 0, 0, .04, .42, .42 and .36 %. Floors of long rooms are longer
// than the wall is, which made it small for them, and deep bounces read them as one cell: 0 and 0, where it was .13 and
// .10 %.
TEST_P(Walls, DoNotLeak) {
  const auto lit = build_text(two_rooms(-1, GetParam().rooms)), dark = build_text(two_rooms(1, GetParam().rooms));
  const RGB expected = render_built(lit, 256, test::bounces(GetParam().bounces, 8)).mean();
  const RGB there = render_built(lit, 8, settings(GetParam().bounces)).mean();
  expect_near(there, expected, 0.02f, "lit room");
  const RGB leaked = render_built(dark, 8, settings(GetParam().bounces)).mean();
  EXPECT_LT(leaked.luminance(), GetParam().bound * there.luminance());
}

INSTANTIATE_TEST_SUITE_P(
    RadiosityCache, Walls,
    testing::Values(WallCase{"quads", {}, 1e-4f}, WallCase{"sheet", {.one_sheet = true}, 1e-4f},
                    WallCase{"planks", {.planks = 40}, 1e-3f}, WallCase{"mesh", {.wall_quads = 100}, 1e-3f},
                    WallCase{"rooms_of_meshes", {.room_quads = 144}, 1e-3f},
                    WallCase{"all_meshes", {.wall_quads = 100, .room_quads = 144}, 2e-3f},
                    WallCase{"long_rooms", {.one_sheet = true, .length = 3, .lamp_height = 1}, 1e-4f, 4},
                    WallCase{"long_rooms_of_panels",
                             {.one_sheet = true, .wall_quads = 4, .length = 3, .lamp_height = 1},
                             1e-4f,
                             4}),
    [](const auto& test) { return std::string(test.param.name); });

// A house of one mesh, in the sun: walls of panels inside and outside, a hand's width apart, and mouldings of a few
// centimetres. A group of many of its patches may have the area of a few panels, on both sides of the walls. Seen: none
// of it inside; 1.1 % of a lit room's light where any patch that shows a ray its side stood for a group, 25 % where
// groups of a few panels are read.
TEST(RadiosityCacheBreakers, HouseOfPanelsAndMouldings) {
  std::string points, indices;
  int count = 0;
  const auto add = [&](const V3f& p, const V3f& s, const V3f& t) {
    for (const V3f& c : {p, p + s, p + s + t, p + t})
      points += std::to_string(c.x) + " " + std::to_string(c.y) + " " + std::to_string(c.z) + "  ";
    for (const int i : {0, 1, 2, 0, 2, 3}) indices += std::to_string(count + i) + " ";
    count += 4;
  };
  for (int axis = 0; axis < 3; ++axis)
    for (const bool outside : {false, true})
      for (const float side : {-1.0f, 1.0f}) {
        const float half = outside ? 2.1f : 2, facing = outside ? side : -side;
        V3f n(0, 0, 0), s(0, 0, 0), t(0, 0, 0);
        n[axis] = side * half, s[(axis + 1) % 3] = facing, t[(axis + 2) % 3] = 1;
        for (int i = 0; i < 2; ++i)
          for (int j = 0; j < 2; ++j)
            add(n + s * (half * float(i - 1)) + t * (half * float(j - 1)), s * half, t * half);
        for (int i = 0; !outside && i < 40; ++i)
          add(n * 0.995f + s * (0.1f * float(i) - 2) + t * 1.5f, s * 0.05f, t * 0.05f);
      }
  const auto house = [&](const std::string& light) {
    return build_text(R"(Film "rgb" "integer xresolution" 32 "integer yresolution" 32
LookAt -1.5 -1.5 1  1 1 -.5  0 0 1
Camera "perspective" "float fov" 80
WorldBegin
)" + light + R"(
Material "diffuse" "rgb reflectance" [ .7 .7 .7 ]
Shape "trianglemesh" "integer indices" [ )" +
                      indices + "] \"point3 P\" [ " + points + "]\n");
  };
  const RGB lit = render_built(house("LightSource \"point\" \"rgb I\" [ 4 4 4 ]\n"), 8, settings(4)).mean();
  const RGB dark =
      render_built(house("LightSource \"distant\" \"point3 from\" [ -3 -2 2 ] \"rgb L\" [ 3 3 3 ]\n"), 8, settings(4))
          .mean();
  EXPECT_LT(dark.luminance(), 1e-4f * lit.luminance()) << dark.luminance() / lit.luminance();
}

// A ceiling over a floor, seen from between them: all its light comes from the floor. `material`: of the floor.
std::string floor_and_ceiling(const std::string& material) {
  return R"(Film "rgb" "integer xresolution" 32 "integer yresolution" 32
PixelFilter "box"
LookAt 0 0 .5  0 0 2  0 1 0
Camera "perspective" "float fov" 90
WorldBegin
LightSource "distant" "point3 from" [ .1 .2 1 ] "point3 to" [ 0 0 0 ] "rgb L" [ 3 3 3 ]
)" + material +
         R"(
Shape "bilinearmesh" "point3 P" [ -2 -2 0  2 -2 0  -2 2 0  2 2 0 ] "point2 uv" [ 0 0  1 0  0 1  1 1 ]
Material "diffuse" "rgb reflectance" [ .7 .7 .7 ]
Shape "bilinearmesh" "point3 P" [ -.5 -.5 1.5  -.5 .5 1.5  .5 -.5 1.5  .5 .5 1.5 ]
)";
}

// Stripes from black to white whose crests lie at the middles of the cells, which all would see white alone: twice the
// light. Seen: 6 %, by few cells and seeds.
TEST(RadiosityCacheBreakers, StripesInStepWithTheCells) {
  for (const int stripes : {8, 16, 64}) {
    const auto built = build_text(floor_and_ceiling(R"(
Texture "x" "float" "coordinate" "string which" "x"
Texture "phase" "float" "multiply" "texture in1" "x" "float in2" )" +
                                                    std::to_string(2 * pi * float(stripes) / 4) + R"(
Texture "shifted" "float" "add" "texture in1" "phase" "float in2" 1.5707963
Texture "wave" "float" "sin" "texture in" "shifted"
Texture "gray" "float" "remap" "texture in" "wave" "float inlow" -1 "float inhigh" 1 "float outlow" 0 "float outhigh" 1
Texture "stripes" "spectrum" "scale" "texture scale" "gray" "rgb tex" [ 1 1 1 ]
Material "diffuse" "texture reflectance" "stripes")"));
    const RGB expected = render_built(built, 512, test::bounces(1, 8)).mean();
    const RGB there = mean_of_seeds(built, settings(1), 4, 16);
    expect_near(there, expected, 0.1f, std::to_string(stripes) + " stripes");
  }
}

// Checks of full contrast, finer than any cell. Seen: .2 %.
TEST(RadiosityCacheBreakers, HighContrastAtTheCoarseLevel) {
  const auto built = build_text(floor_and_ceiling(R"(
Texture "checks" "spectrum" "checkerboard" "float uscale" 37 "float vscale" 37 "rgb tex1" [ 1 0 .5 ] "rgb tex2" [ 0 1 .5 ]
Material "diffuse" "texture reflectance" "checks")"));
  const RGB expected = render_built(built, 512, test::bounces(1, 8)).mean();
  const RGB there = mean_of_seeds(built, settings(1), 4, 8);
  expect_near(there, expected, 0.03f, "checks");
}

// A lamp of 2 cm, 10 cm from a wall: most of the indirect light of the room comes from a spot of a hand's width. Where
// wide cells are read there, the mean of the picture is off by 130 % from seed to seed; now by 12 %.
TEST(RadiosityCacheBreakers, SmallBrightLamp) {
  std::string text = R"(Film "rgb" "integer xresolution" 40 "integer yresolution" 30
PixelFilter "box"
LookAt 1.5 1 0  -2 1 0  0 1 0
Camera "perspective" "float fov" 70
WorldBegin
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 20000 20000 20000 ]
  Shape "bilinearmesh" "point3 P" [ 1.9 1 -.01  1.9 1.02 -.01  1.9 1 .01  1.9 1.02 .01 ]
AttributeEnd
Material "diffuse" "rgb reflectance" [ .7 .7 .7 ]
)";
  for (const std::string& side : {test::wall({-2, 0, 2}, {2, 0, 2}, {-2, 0, -2}, {2, 0, -2}),
                                  test::wall({-2, 2, -2}, {2, 2, -2}, {-2, 2, 2}, {2, 2, 2}),
                                  test::wall({-2, 0, -2}, {2, 0, -2}, {-2, 2, -2}, {2, 2, -2}),
                                  test::wall({2, 0, 2}, {-2, 0, 2}, {2, 2, 2}, {-2, 2, 2}),
                                  test::wall({-2, 0, 2}, {-2, 0, -2}, {-2, 2, 2}, {-2, 2, -2}),
                                  test::wall({2, 0, -2}, {2, 0, 2}, {2, 2, -2}, {2, 2, 2})})
    text += side;
  const auto built = build_text(text);
  const float expected = render_built(built, 4096, test::bounces(1, 8)).mean().g;
  constexpr int seeds = 8;
  float squares = 0;
  for (uint64_t seed = 0; seed < seeds; ++seed) {
    auto s = settings(1, {64, 16});
    s.shading.seed = seed;
    squares += sqr(render_built(built, 4, s).mean().g / expected - 1);
  }
  EXPECT_LT(std::sqrt(squares / seeds), 0.3f);
}

// A sheet between a red and a green light: what the side that one sees sends on has nothing of the other.
TEST(RadiosityCacheBreakers, TwoSidesOfASheet) {
  const auto built = build_text(R"(Film "rgb" "integer xresolution" 32 "integer yresolution" 32
PixelFilter "box"
LookAt 0 -3 .5  0 0 .5  0 0 1
Camera "perspective" "float fov" 60
WorldBegin
LightSource "distant" "point3 from" [ 0 0 1 ] "point3 to" [ 0 0 0 ] "rgb L" [ 3 0 0 ]
LightSource "distant" "point3 from" [ 0 0 -1 ] "point3 to" [ 0 0 0 ] "rgb L" [ 0 3 0 ]
Material "diffuse" "rgb reflectance" [ .8 .8 .8 ]
Shape "bilinearmesh" "point3 P" [ -2 -2 0  2 -2 0  -2 2 0  2 2 0 ]
Shape "bilinearmesh" "point3 P" [ -.5 1 .2  .5 1 .2  -.5 1 1  .5 1 1 ]
)");
  const RGB expected = render_built(built, 1024, test::bounces(2, 8)).mean(),
            there = mean_of_seeds(built, settings(2), 8, 4);
  EXPECT_EQ(there.g, 0);
  EXPECT_NEAR(there.r, expected.r, 0.02f * expected.r);
}

// A white board flies 2 m through a dark room while the shutter is open: it is lit where it is in the middle of that
// time, and so is what it lights. Seen: 0, and .5 %.
TEST(RadiosityCacheBreakers, FastMovingBoard) {
  const auto built = build_text(R"(Film "rgb" "integer xresolution" 48 "integer yresolution" 32
PixelFilter "box"
LookAt 0 -4 1.2  0 0 .8  0 0 1
Camera "perspective" "float fov" 50 "float shutteropen" 0 "float shutterclose" 1
WorldBegin
LightSource "distant" "point3 from" [ .3 -1 1 ] "point3 to" [ 0 0 0 ] "rgb L" [ 3 3 3 ]
Material "diffuse" "rgb reflectance" [ .4 .4 .4 ]
Shape "bilinearmesh" "point3 P" [ -3 -2 0  3 -2 0  -3 2 0  3 2 0 ]
AttributeBegin
  ActiveTransform StartTime
  Translate -1 0 0
  ActiveTransform EndTime
  Translate 1 0 0
  ActiveTransform All
  Material "diffuse" "rgb reflectance" [ .9 .1 .1 ]
  Shape "bilinearmesh" "point3 P" [ -.4 .5 .1  .4 .5 .1  -.4 .5 1.2  .4 .5 1.2 ]
AttributeEnd
)");
  auto uncached = settings(1);
  uncached.radiosity_cache = false;
  const RGB expected = render_built(built, 16, uncached).mean(), there = render_built(built, 16, settings(1)).mean(),
            path = render_built(built, 1024, test::bounces(1, 8)).mean();
  expect_near(there, expected, 0.01f, "against shading every hit");
  expect_near(there, path, 0.03f, "against path tracing");
}

// A floor of polished metal: what diffuse rays see in it is not in the cache. Seen: .1 %.
TEST(RadiosityCacheBreakers, GlossyFloor) {
  const auto built =
      build_text(floor_and_ceiling(R"(Material "conductor" "rgb reflectance" [ .9 .7 .4 ] "float roughness" .3
LightSource "infinite" "rgb L" [ .2 .3 .5 ])"));
  const RGB expected = render_built(built, 1024, test::bounces(2, 8)).mean(),
            there = mean_of_seeds(built, settings(2), 8, 4);
  expect_near(there, expected, 0.03f, "gloss");
}

// Two rooms, one lit 250 times as brightly, whose sides are meshes of n x n patches, and a wall without thickness
// across the middle of a row of them. `aslant`: how far the wall's ends lie off its middle, across the row.
std::string rooms_of_meshes(int n, float aslant = 0) {
  std::string text = R"(Film "rgb" "integer xresolution" 64 "integer yresolution" 48
LookAt -3.8 0 1.5  0 .2 1.2  0 0 1
Camera "perspective" "float fov" 70
WorldBegin
)";
  for (const auto& [x, L] : {std::pair(2, "100 100 100"), std::pair(-2, ".4 .4 .4")})
    text += "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ " + std::string(L) + " ]\nTranslate " +
            std::to_string(x) + R"( 0 2.98
Shape "bilinearmesh" "point3 P" [ -.5 -.5 0  -.5 .5 0  .5 -.5 0  .5 .5 0 ]
AttributeEnd
)";
  text += "Material \"diffuse\" \"rgb reflectance\" [ .6 .6 .6 ]\n";
  for (const std::string& side :
       {test::wall({-4, -2, 0}, {4, -2, 0}, {-4, 2, 0}, {4, 2, 0}, n),
        test::wall({-4, -2, 3}, {-4, 2, 3}, {4, -2, 3}, {4, 2, 3}, n),
        test::wall({-4, -2, 0}, {-4, 2, 0}, {-4, -2, 3}, {-4, 2, 3}, n),
        test::wall({4, -2, 0}, {4, 2, 0}, {4, -2, 3}, {4, 2, 3}, n),
        test::wall({-4, -2, 0}, {4, -2, 0}, {-4, -2, 3}, {4, -2, 3}, n),
        test::wall({-4, 2, 0}, {4, 2, 0}, {-4, 2, 3}, {4, 2, 3}, n),
        test::wall({.2f - aslant, -2, 0}, {.2f + aslant, 2, 0}, {.2f - aslant, -2, 3}, {.2f + aslant, 2, 3})})
    text += side;
  return text;
}

// Patches of about three pixels: each is one shading point, those under the wall on the bright side. Seen: path
// tracing's mean + .1 %, + 440 % where one point speaks for both sides.
TEST(RadiosityCacheBreakers, WallAcrossSmallPatches) {
  const auto built = build_text(rooms_of_meshes(16));
  const RGB expected = render_built(built, 256, test::bounces(0, 8)).mean();
  auto s = settings(0);
  s.pixel_points = 3;
  expect_near(render_built(built, 16, s).mean(), expected, .03f, "small patches");
}

// A known limit (docs/guide/quality.md): a wall without thickness that crosses meshes of small patches aslant. Each
// patch it cuts is one or few points of the cache, which speak for both sides. Seen: + 30 % in indirect light; the
// bound says that it does not grow. Without the cache nothing leaks.
TEST(RadiosityCacheBreakers, WallAslantAcrossSmallPatchesIsALimit) {
  const auto built = build_text(rooms_of_meshes(16, .3f));
  const float expected = render_built(built, 256, test::bounces(2, 8)).mean().g;
  auto s = settings(2, {16, 4});
  s.pixel_points = 3;
  EXPECT_LT(render_built(built, 4, s).mean().g, 2 * expected);
  s.radiosity_cache = false;
  EXPECT_NEAR(render_built(built, 4, s).mean().g, expected, .03f * expected);
}

// Patches of which the wall leaves 20 cm: all hemispheres of such a patch stand on its other side. Seen: path tracing's
// mean - .2 %, + 230 % where hemispheres reach through the wall.
TEST(RadiosityCacheBreakers, WallBesideHemispheres) {
  const auto built = build_text(rooms_of_meshes(4));
  const RGB expected = render_built(built, 512, test::bounces(2, 8)).mean();
  auto s = settings(2, {64, 4});
  s.irradiance_interpolation = true;
  s.irradiance_accuracy = .5f;
  s.pixel_points = 3;
  expect_near(render_built(built, 16, s).mean(), expected, .03f, "hemispheres");
}

struct WindowCase {
  const char *name, *light;
  double allowed;
};
void PrintTo(const WindowCase& c, std::ostream* os) {
  *os << c.name;
}

class WindowsOfTheCache : public testing::TestWithParam<WindowCase> {};

// A room that is lit through a window, of which each place sees little, or by the spot that the sun throws: entries
// with a few shadow rays, from a few places, are bright by chance, the widest of them for the whole room. So these send
// more, and none is as wide as a wall. Root of the mean square of what the image's means of 8 seeds are off path
// tracing's: seen .8 and 1.1 %; 1.2 and 4.1 % where cells may be as wide as a wall.
TEST_P(WindowsOfTheCache, LightRoomsSteadily) {
  std::string text = R"(Film "rgb" "integer xresolution" 40 "integer yresolution" 30
LookAt 1 1.6 2.5  2.2 1.1 -1  0 1 0
Camera "perspective" "float fov" 65
WorldBegin
)" + std::string(GetParam().light) +
                     R"(
Material "diffuse" "rgb reflectance" [ .7 .7 .7 ]
)";
  const std::string walls[] = {test::wall({0, 0, 3}, {5, 0, 3}, {0, 0, -2}, {5, 0, -2}),
                               test::wall({0, 3, -2}, {5, 3, -2}, {0, 3, 3}, {5, 3, 3}),
                               test::wall({0, 0, -2}, {5, 0, -2}, {0, 3, -2}, {5, 3, -2}),
                               test::wall({5, 0, 3}, {0, 0, 3}, {5, 3, 3}, {0, 3, 3}),
                               test::wall({0, 0, 3}, {0, 0, -2}, {0, 3, 3}, {0, 3, -2}),
                               test::wall({5, 0, -2}, {5, 0, 3}, {5, .8f, -2}, {5, .8f, 3}),
                               test::wall({5, 2.2f, -2}, {5, 2.2f, 3}, {5, 3, -2}, {5, 3, 3}),
                               test::wall({5, .8f, -2}, {5, .8f, -.5f}, {5, 2.2f, -2}, {5, 2.2f, -.5f}),
                               test::wall({5, .8f, 1.5f}, {5, .8f, 3}, {5, 2.2f, 1.5f}, {5, 2.2f, 3})};
  for (const std::string& wall : walls) text += wall;
  const auto built = build_text(text);
  const double expected = render_built(built, 1024, test::bounces(4, 8)).mean().luminance();
  auto s = settings(4, {64, 4});
  s.shading.shadow_rays = RayList{16, 4};
  double squares = 0;
  constexpr int seeds = 8;
  for (int seed = 0; seed < seeds; ++seed) {
    s.shading.seed = uint64_t(seed);
    squares += sqr(render_built(built, 8, s).mean().luminance() / expected - 1);
  }
  EXPECT_LT(std::sqrt(squares / seeds), GetParam().allowed);
}
INSTANTIATE_TEST_SUITE_P(
    , WindowsOfTheCache,
    testing::Values(
        WindowCase{"sky", R"(LightSource "infinite" "rgb L" [ 1 1 1 ])", .02},
        WindowCase{"sun", R"(LightSource "distant" "point3 from" [ 5 4 2 ] "point3 to" [ 0 0 0 ] "rgb L" [ 8 8 8 ])",
                   .025}),
    [](const auto& of) { return of.param.name; });

// A camera moves along a wall by an eighth of a pixel a frame and more: the wall's indirect light from frame to frame,
// moved back by whole pixels. Entries and shading points do not know the camera, so it is that of other samples of the
// same lattice. A path tracer of as many samples, and grids whose seeds change with the frame, as those of an animation
// without this property do, flicker with their whole noise. Bounds: a fifth of theirs (the issue's), with hemispheres
// of 144 rays. Seen: 1/120 and 1/150.
TEST(RadiosityCacheBreakers, MovingCameraDoesNotFlicker) {
  constexpr int frames = 6, size = 48;
  constexpr float pixel = 2 * 2 * 0.41421356f / float(size);  // on the wall, 2 m away, at 45 degrees
  const auto frame = [&](float pixels) {
    const std::string x = std::to_string(pixels * pixel);
    std::string text = R"(Film "rgb" "integer xresolution" 48 "integer yresolution" 48
PixelFilter "box"
LookAt )" + x + " 1 0  " +
                       x + R"( 1 -1  0 1 0
Camera "perspective" "float fov" 45
WorldBegin
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 10 10 10 ]
  Shape "bilinearmesh" "point3 P" [ .5 1.5 1.9  -.5 1.5 1.9  .5 1.9 1.9  -.5 1.9 1.9 ]
AttributeEnd
Material "diffuse" "rgb reflectance" [ .7 .7 .7 ]
)";
    for (const std::string& side : {test::wall({-2, 0, 2}, {2, 0, 2}, {-2, 0, -2}, {2, 0, -2}),
                                    test::wall({-2, 2, -2}, {2, 2, -2}, {-2, 2, 2}, {2, 2, 2}),
                                    test::wall({-2, 0, -2}, {2, 0, -2}, {-2, 2, -2}, {2, 2, -2}),
                                    test::wall({2, 0, 2}, {-2, 0, 2}, {2, 2, 2}, {-2, 2, 2}),
                                    test::wall({-2, 0, 2}, {-2, 0, -2}, {-2, 2, 2}, {-2, 2, -2}),
                                    test::wall({2, 0, -2}, {2, 0, 2}, {2, 2, -2}, {2, 2, 2})})
      text += side;
    return build_text(text);
  };
  // RMS difference of indirect light between frames whose pixels, moved, see the same, relative to its mean.
  const auto flicker = [&](const auto& settings_of) {
    std::vector<std::vector<float>> light;
    const float moves[frames] = {0, 1.125f, 2, 3.25f, 4, 5.5f};
    float mean = 0;
    for (int f = 0; f < frames; ++f) {
      const auto built = frame(moves[f]);
      auto [all, direct] = settings_of(uint64_t(f));
      const auto a = render_built(built, 16, all), b = render_built(built, 16, direct);
      auto& of_frame = light.emplace_back();
      for (int y = 8; y < size - 8; ++y)
        for (int x = 8; x < size - 8; ++x) {
          const int from = x + int(std::lround(moves[f]));  // left is +x
          of_frame.push_back((a.film.pixel(from, y) - b.film.pixel(from, y)).luminance());
          mean += of_frame.back();
        }
    }
    mean /= float(frames) * float(light[0].size());
    float squares = 0;
    for (int f = 1; f < frames; ++f)
      for (size_t i = 0; i < light[0].size(); ++i) squares += sqr(light[size_t(f)][i] - light[size_t(f - 1)][i]);
    return std::sqrt(squares / (float(frames - 1) * float(light[0].size()))) / mean;
  };
  const auto direct_of = [](auto s) {
    if constexpr (requires { s.shading.bounces; })
      s.shading.bounces = 0;
    else
      s.diffuse_bounces = 0;
    return s;
  };
  auto smooth = settings(2, {144, 4});
  smooth.irradiance_interpolation = true;
  auto uncached = settings(2, {4});
  uncached.radiosity_cache = false;
  const float cached = flicker([&](uint64_t) { return std::pair(smooth, direct_of(smooth)); });
  const float other_seeds = flicker([&](uint64_t f) {
    auto s = uncached;
    s.shading.seed = f;
    return std::pair(s, direct_of(s));
  });
  const float path = flicker([&](uint64_t f) {
    auto s = test::bounces(2, 8);
    s.seed = f;
    return std::pair(s, direct_of(s));
  });
  EXPECT_LT(5 * cached, other_seeds);
  EXPECT_LT(5 * cached, path);
}

// Many threads in a cache of 1 MB, and of less than the entries that they hold at a time: the same image as of one in
// memory without end.
TEST(RadiosityCacheBreakers, ManyThreadsInLittleMemory) {
  const auto built = build_text(two_rooms(-1, {.wall_quads = 4, .room_quads = 8}));
  auto s = settings(3, {9, 4, 2});
  s.shading.cache_width = 0.01f;
  s.cache_bytes = size_t(1) << 30;
  set_thread_count(1);
  const auto whole = render_built(built, 4, s);
  set_thread_count(16);
  for (const size_t bytes : {size_t(1) << 20, size_t(30000)}) {
    s.cache_bytes = bytes;
    const auto other = render_built(built, 4, s);
    EXPECT_TRUE(same_bits(whole.film, other.film)) << bytes;
    uint64_t evictions = 0, capacity = 0;
    for (const integrate::CacheState& c : other.result.caches)
      if (c.name != "grids") evictions += c.evictions, capacity += c.capacity_bytes;
    EXPECT_GT(evictions, 10u) << bytes;
    EXPECT_LE(capacity, bytes);
  }
  set_thread_count(0);
}

}  // namespace
}  // namespace dapple
