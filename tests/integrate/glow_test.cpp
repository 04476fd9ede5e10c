// SPDX-License-Identifier: Apache-2.0
// Media that glow as a light: against quadrature, and against what rays find that only happen to meet them.
#include <gtest/gtest.h>

#include <cmath>

#include "dapple/base/parallel.h"
#include "dapple/emitters/light_sampler.h"
#include "tests/support/render_text.h"

namespace dapple::test {
namespace {

using distribution::DistributionIntegrator;

// A ball of gas at height 1, cut out of a box that is the same everywhere around it.
constexpr double radius = .4, height = 1, sigma_a = 2, Le = 20;

const std::string gas_over_a_floor = R"(Film "rgb" "integer xresolution" 8 "integer yresolution" 8
PixelFilter "box" "float xradius" .5 "float yradius" .5
LookAt .6 -2 .8  .6 0 0  0 0 1
Camera "perspective" "float fov" .5
WorldBegin
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
Shape "bilinearmesh" "point3 P" [ -9 -9 0  9 -9 0  -9 9 0  9 9 0 ]
MakeNamedMedium "fire" "string type" "uniformgrid" "integer nx" 2 "integer ny" 2 "integer nz" 2
"point3 p0" [ -1 -1 0 ] "point3 p1" [ 1 1 2 ] "rgb sigma_a" [ 2 2 2 ] "rgb sigma_s" [ 0 0 0 ] "rgb Le" [ 20 10 5 ]
"float density" [ 1 1 1 1 1 1 1 1 ]
AttributeBegin
MediumInterface "fire" ""
Material "interface"
Translate 0 0 1
Shape "sphere" "float radius" .4
AttributeEnd
)";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

const std::string ball = "Shape \"sphere\" \"float radius\" .4\n", cube = R"(Shape "trianglemesh"
"integer indices" [ 0 2 3 0 3 1 4 5 7 4 7 6 0 1 5 0 5 4 2 6 7 2 7 3 0 4 6 0 6 2 1 3 7 1 7 5 ] "point3 P" [
-.4 -.4 -.4  .4 -.4 -.4  -.4 .4 -.4  .4 .4 -.4  -.4 -.4 .4  .4 -.4 .4  -.4 .4 .4  .4 .4 .4 ]
)";
const std::string grid_type = R"("uniformgrid" "integer nx" 2 "integer ny" 2 "integer nz" 2
"point3 p0" [ -1 -1 0 ] "point3 p1" [ 1 1 2 ])",
                  grid_density = "\"float density\" [ 1 1 1 1 1 1 1 1 ]\n";

std::string homogeneous(const std::string& text) {
  return replaced(replaced(text, grid_type, "\"homogeneous\""), grid_density, "");
}

// From q in the ball or the cube, along u.
double way_out(const V3d& q, const V3d& u, bool is_ball) {
  if (is_ball) return -q.dot(u) + std::sqrt(std::pow(q.dot(u), 2) + radius * radius - q.length2());
  double out = 1e9;
  for (int k = 0; k < 3; ++k)
    if (u[k] != 0) out = std::min(out, ((u[k] > 0 ? radius : -radius) - q[k]) / u[k]);
  return out;
}

// Irradiance at a point of the floor: of each bit of the body, what it emits, over the distance squared, times the
// cosine, less what the body absorbs on the way.
double irradiance(const V3d& at, bool is_ball) {
  constexpr int n = 80;
  const double h = 2 * radius / n;
  double sum = 0;
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        const V3d q((x + .5) * h - radius, (y + .5) * h - radius, (z + .5) * h - radius);
        if (is_ball && q.length2() >= radius * radius) continue;
        const V3d d = at - (q + V3d(0, 0, height));
        const double distance = d.length(), inside = way_out(q, d / distance, is_ball);
        sum += sigma_a * Le * std::exp(-sigma_a * inside) * -d.z / std::pow(distance, 3);
      }
  return sum * h * h * h;
}

path::PathIntegrator::Settings direct() {
  return bounces(0, 0);
}

TEST(Glow, LightsAFloorAsQuadratureSays) {
  for (const bool is_ball : {true, false}) {
    const double expected = .5 / std::numbers::pi * irradiance(V3d(.6, 0, 0), is_ball);
    const RGB red(float(expected), float(expected / 2), float(expected / 4));
    const std::string grid = is_ball ? gas_over_a_floor : replaced(gas_over_a_floor, ball, cube);
    for (const std::string& text : {grid, homogeneous(grid)}) {
      const auto built = build_text(text);
      ASSERT_EQ(built.scene->lights.size(), 1u);
      ASSERT_FALSE(built.scene->glow.empty());
      const std::string what = is_ball ? "ball" : "cube";
      expect_near(render_built(built, 4096, direct()).mean(), red, .01f, what);
      for (const int bounces : {0, 1}) {  // with rays that look for lights, too
        DistributionIntegrator::Settings s;
        s.shading.bounces = bounces;
        s.shading.shadow_rays = {4096};  // all pixels see the same few points
        s.shading.diffuse_rays = {256, 1};
        expect_near(render_built(built, 4, s).mean(), red, .015f, what + ", bounces " + std::to_string(bounces));
      }
    }
  }
}

double noise(const RenderedText& r) {
  const double mean = double(r.mean().g);
  double sum = 0;
  for (int y = 0; y < r.film.height(); ++y)
    for (int x = 0; x < r.film.width(); ++x) sum += std::pow(double(r.film.pixel(x, y).g) / mean - 1, 2);
  return std::sqrt(sum / (r.film.width() * r.film.height()));
}

// The same gas as a grid, which is even between the middles of its voxels, and without.
const std::string even_grid =
    R"(MakeNamedMedium "fire" "string type" "uniformgrid" "integer nx" 2 "integer ny" 2 "integer nz" 2
"point3 p0" [ -3 -3 -2 ] "point3 p1" [ 3 3 4 ] "rgb sigma_a" [ 1 2 3 ] "rgb sigma_s" [ 4 3 2 ] "float g" .4
"rgb Le" [ 6 3 1 ] "float density" [ 1 1 1 1 1 1 1 1 ]
)";
const std::string even = R"(MakeNamedMedium "fire" "string type" "homogeneous" "rgb sigma_a" [ 1 2 3 ]
"rgb sigma_s" [ 4 3 2 ] "float g" .4 "rgb Le" [ 6 3 1 ]
)";

// What its media emit is found by rays that meet them, and by nothing else.
void leave_to_chance(scene::Scene* scene) {
  scene->lights.resize(std::min(scene->lights.size(), size_t(scene->glow.first_light())));
  scene->glow = {};
  std::vector<const emitters::Light*> lights;
  for (const auto& light : scene->lights) lights.push_back(light.get());
  scene->light_sampler.reset();
  if (!lights.empty()) scene->light_sampler = std::make_unique<emitters::LightSampler>(lights, 6.0f);
}
const std::string hall = R"(
AttributeBegin
MediumInterface "fire" ""
Material "interface"
Translate .3 .2 .9
Shape "sphere" "float radius" .4
AttributeEnd
Material "diffuse" "rgb reflectance" [ .6 .6 .6 ]
Shape "bilinearmesh" "point3 P" [ -4 -4 0  4 -4 0  -4 4 0  4 4 0 ]
Material "diffuse" "rgb reflectance" [ .6 .2 .2 ]
Shape "bilinearmesh" "point3 P" [ -4 2 0  4 2 0  -4 2 4  4 2 4 ]
AttributeBegin
Material "conductor" "float roughness" .1
Translate -1 .6 .5
Shape "sphere" "float radius" .5
AttributeEnd
AttributeBegin
Material "thindielectric"
Shape "bilinearmesh" "point3 P" [ -.4 -.6 0  1 -.6 0  -.4 -.6 .5  1 -.6 .5 ]
AttributeEnd
AttributeBegin
AreaLightSource "diffuse" "rgb L" [ 2 2 2 ]
Shape "bilinearmesh" "point3 P" [ -3 1 2.9  -3 -1 2.9  -2 1 2.9  -2 -1 2.9 ]
AttributeEnd
)";
const std::string view = R"(Film "rgb" "integer xresolution" 24 "integer yresolution" 24
PixelFilter "box" "float xradius" .5 "float yradius" .5
LookAt 0 -3 1  0 0 .7  0 0 1
Camera "perspective" "float fov" 60
WorldBegin
)";

TEST(Glow, IsTheLightThatRaysFindByChance) {
  const auto chance = build_text(view + even + hall);
  leave_to_chance(chance.scene.get());
  ASSERT_TRUE(chance.scene->glow.empty());
  const RGB expected = render_built(chance, 8192, bounces(2, 16)).mean();
  DistributionIntegrator::Settings s;
  s.visible_points = distribution::VisiblePoints::samples;
  s.shading.bounces = 2;
  s.shading.shadow_rays = {4};
  s.shading.diffuse_rays = {16, 4, 1};
  for (const std::string& medium : {even, even_grid}) {
    const auto light = build_text(view + medium + hall);
    ASSERT_FALSE(light.scene->glow.empty());
    expect_near(render_built(light, 4096, bounces(2, 16)).mean(), expected, .01f, "path");
    for (const bool cache : {false, true}) {
      s.radiosity_cache = cache;
      RGB mean;
      constexpr int seeds = 4;  // each by 1.4 % of its own
      for (int seed = 0; seed < seeds; ++seed) {
        s.shading.seed = uint64_t(seed);
        mean += render_built(light, 256, s).mean() * (1.0f / seeds);
      }
      expect_near(mean, expected, .03f, cache ? "cached" : "uncached");
    }
  }
}

const std::string above = R"(Film "rgb" "integer xresolution" 16 "integer yresolution" 16
PixelFilter "box" "float xradius" .5 "float yradius" .5
LookAt .6 -6 3  .6 0 0  0 0 1
Camera "perspective" "float fov" .5
WorldBegin
)",
                  coefficients = R"("rgb sigma_a" [ 2 2 2 ] "rgb sigma_s" [ 0 0 0 ] "rgb Le" [ 6 6 6 ] "string type")",
                  floor_below = R"(Material "diffuse" "rgb reflectance" [ .6 .6 .6 ]
Shape "bilinearmesh" "point3 P" [ -4 -4 0  4 -4 0  -4 4 0  4 4 0 ]
)";
std::string flame(float x, float y, const std::string& medium = "fire") {
  return "AttributeBegin\nMediumInterface \"" + medium + "\" \"\"\nMaterial \"interface\"\nTranslate " +
         std::to_string(x) + " " + std::to_string(y) + " 1\nShape \"sphere\" \"float radius\" .1\nAttributeEnd\n";
}
std::string grid(const std::string& name, float half) {
  const auto corner = [&](float side) {
    return " [ " + std::to_string(side) + " " + std::to_string(side) + " " + std::to_string(1 + side) + " ]";
  };
  return "MakeNamedMedium \"" + name + "\" " + coefficients +
         " \"uniformgrid\" \"integer nx\" 2 \"integer ny\" 2 \"integer nz\" 2 \"point3 p0\"" + corner(-half) +
         " \"point3 p1\"" + corner(half) + " \"float density\" [ 1 1 1 1 1 1 1 1 ]\n";
}
const std::string even_fire = "MakeNamedMedium \"fire\" " + coefficients + " \"homogeneous\"\n";

TEST(Glow, IsLessNoisyThanChance) {
  for (const std::string& medium : {grid("fire", .2f), even_fire}) {
    const auto built = build_text(above + medium + flame(0, 0) + floor_below);
    const auto light = render_built(built, 64, bounces(1, 0));
    leave_to_chance(built.scene.get());
    const auto chance = render_built(built, 64, bounces(1, 0));
    EXPECT_GT(chance.mean().g, 0);
    EXPECT_LT(noise(light), noise(chance) / (medium == even_fire ? 6 : 3));
  }
}

// A small flame in a large grid: what lies in no shape is not looked for.
TEST(Glow, OfAGridIsLookedForInItsShapes) {
  const auto lit = [](float half) {
    return noise(render_text(above + grid("fire", half) + flame(0, 0) + floor_below, 256, bounces(0, 0)));
  };
  EXPECT_LT(lit(2), 1.2 * lit(.2f));
}

// Each of twelve flames is a light, of which the nearest are chosen.
TEST(Glow, OfManyFlamesIsChosenByDistance) {
  std::string flames;
  for (int i = 0; i < 12; ++i) flames += flame(-3.3f + .6f * float(i), i % 2 == 0 ? 0.0f : 3.0f);
  const auto many = build_text(above + even_fire + flames + floor_below);
  ASSERT_EQ(many.scene->lights.size(), 12u);
  const emitters::LightReceiver below{.p = V3f(.3f, 0, 0), .n = V3f(0, 0, 1)};
  EXPECT_GT(many.scene->light_sampler->probability(below, 6), .3f);  // the flame above it; a twelfth of all is .083
  const RGB found = render_built(many, 1024, bounces(0, 0)).mean();
  leave_to_chance(many.scene.get());
  expect_near(found, render_built(many, 16384, bounces(1, 0)).mean(), .02f, "twelve");
}

TEST(Glow, IsTheSameForAnyNumberOfThreadsAndAnyCache) {
  const auto built = build_text(view + even_grid + hall);
  DistributionIntegrator::Settings s;
  s.radiosity_cache = true;
  s.shading.bounces = 1;
  s.shading.diffuse_rays = {8, 4};
  const auto whole = render_built(built, 2, s);
  set_thread_count(1);
  s.cache_bytes = 0;
  const auto alone = render_built(built, 2, s);
  set_thread_count(0);
  EXPECT_TRUE(same_bits(whole.film, alone.film));
}

// What lies in no shape glows nowhere, and black bodies do by their temperature.
TEST(Glow, IsOfMediaThatAreSomewhere) {
  EXPECT_TRUE(build_text(view + even_grid).scene->glow.empty());
  const std::string cold =
      R"(MakeNamedMedium "fire" "string type" "uniformgrid" "integer nx" 2 "integer ny" 2 "integer nz" 2
"point3 p0" [ -1 -1 0 ] "point3 p1" [ 1 1 2 ] "float density" [ 1 1 1 1 1 1 1 1 ] "float temperature" [)";
  EXPECT_TRUE(build_text(view + cold + " 0 0 0 0 0 0 0 0 ]\n" + hall).scene->glow.empty());
  EXPECT_FALSE(build_text(view + cold + " 0 0 0 0 0 0 3000 3000 ]\n" + hall).scene->glow.empty());
}

// Shapes that touch are one place; what is around all shapes, or in one that moves, is left to chance.
TEST(Glow, HasAPlaceForEachShape) {
  const auto lights = [](const std::string& text) { return build_text(above + even_fire + text).scene->lights.size(); };
  EXPECT_EQ(lights(flame(0, 0) + flame(.15f, 0) + flame(1, 0)), 2u);
  EXPECT_EQ(lights("ObjectBegin \"candle\"\n" + flame(0, 0) +
                   "ObjectEnd\nObjectInstance \"candle\"\nTranslate 1 0 0\nObjectInstance \"candle\"\n"),
            2u);
  EXPECT_EQ(lights("MediumInterface \"\" \"fire\"\nMaterial \"interface\"\nShape \"sphere\"\n"), 0u);
  // A bubble in the fire.
  EXPECT_EQ(lights("Material \"interface\"\nMediumInterface \"fire\" \"\"\nShape \"sphere\"\n"
                   "MediumInterface \"\" \"fire\"\nShape \"sphere\" \"float radius\" .3\n"),
            1u);
  EXPECT_EQ(lights("ObjectBegin \"candle\"\n" + flame(0, 0) +
                   "ObjectEnd\nActiveTransform EndTime\nTranslate 1 0 0\nActiveTransform All\n"
                   "ObjectInstance \"candle\"\n"),
            0u);
}

}  // namespace
}  // namespace dapple::test
