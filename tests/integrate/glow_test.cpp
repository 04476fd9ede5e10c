// SPDX-License-Identifier: Apache-2.0
// Media that glow as a light: against quadrature, and against what rays find that only happen to meet them.
#include <gtest/gtest.h>

#include <cmath>

#include "dapple/base/parallel.h"
#include "tests/support/render_text.h"

namespace dapple::test {
namespace {

using distribution::DistributionIntegrator;

// A ball of gas at height 1, cut out of a box that is the same everywhere around it.
constexpr double radius = .4, height = 1, sigma_a = 2, Le = 20;

const std::string ball_over_a_floor = R"(Film "rgb" "integer xresolution" 8 "integer yresolution" 8
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

// Irradiance at a point of the floor: of each bit of the ball, what it emits, over the distance squared, times the
// cosine, less what the ball absorbs on the way.
double irradiance(const V3d& at) {
  constexpr int n = 80;
  const double h = 2 * radius / n;
  double sum = 0;
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        const V3d q((x + .5) * h - radius, (y + .5) * h - radius, (z + .5) * h - radius);
        if (q.length2() >= radius * radius) continue;
        const V3d d = at - (q + V3d(0, 0, height));
        const double distance = d.length(), b = q.dot(d) / distance;
        const double inside = -b + std::sqrt(b * b + radius * radius - q.length2());
        sum += sigma_a * Le * std::exp(-sigma_a * inside) * -d.z / std::pow(distance, 3);
      }
  return sum * h * h * h;
}

path::PathIntegrator::Settings direct() {
  return bounces(0, 0);
}

TEST(Glow, LightsAFloorAsQuadratureSays) {
  const auto built = build_text(ball_over_a_floor);
  ASSERT_TRUE(built.scene->has_glow());
  const double expected = .5 / std::numbers::pi * irradiance(V3d(.6, 0, 0));
  const RGB red(float(expected), float(expected / 2), float(expected / 4));
  expect_near(render_built(built, 2048, direct()).mean(), red, .01f, "path");
  for (const int bounces : {0, 1}) {  // with rays that look for lights, too
    DistributionIntegrator::Settings s;
    s.shading.bounces = bounces;
    s.shading.shadow_rays = {1024};  // all pixels see the same few points
    s.shading.diffuse_rays = {256, 1};
    expect_near(render_built(built, 4, s).mean(), red, .02f, "distribution, bounces " + std::to_string(bounces));
  }
}

double noise(const RenderedText& r) {
  const double mean = double(r.mean().g);
  double sum = 0;
  for (int y = 0; y < r.film.height(); ++y)
    for (int x = 0; x < r.film.width(); ++x) sum += std::pow(double(r.film.pixel(x, y).g) / mean - 1, 2);
  return std::sqrt(sum / (r.film.width() * r.film.height()));
}

// The same gas as a grid, and as one that rays find only by chance: a homogeneous medium is no light.
const std::string even_grid =
    R"(MakeNamedMedium "fire" "string type" "uniformgrid" "integer nx" 2 "integer ny" 2 "integer nz" 2
"point3 p0" [ -1 -1 0 ] "point3 p1" [ 1 1 2 ] "rgb sigma_a" [ 1 2 3 ] "rgb sigma_s" [ 4 3 2 ] "float g" .4
"rgb Le" [ 6 3 1 ] "float density" [ 1 1 1 1 1 1 1 1 ]
)";
const std::string even = R"(MakeNamedMedium "fire" "string type" "homogeneous" "rgb sigma_a" [ 1 2 3 ]
"rgb sigma_s" [ 4 3 2 ] "float g" .4 "rgb Le" [ 6 3 1 ]
)";
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
  const auto light = build_text(view + even_grid + hall), chance = build_text(view + even + hall);
  ASSERT_TRUE(light.scene->has_glow());
  ASSERT_FALSE(chance.scene->has_glow());
  const auto expected = render_built(chance, 2048, bounces(2, 16)), found = render_built(light, 1024, bounces(2, 16));
  expect_near(found.mean(), expected.mean(), .01f, "path");
  DistributionIntegrator::Settings s;
  s.shading.bounces = 2;
  s.shading.shadow_rays = {4};
  s.shading.diffuse_rays = {16, 4, 1};
  for (const bool cache : {false, true}) {
    s.radiosity_cache = cache;
    expect_near(render_built(light, 64, s).mean(), expected.mean(), cache ? .03f : .02f, cache ? "cached" : "uncached");
  }
}

TEST(Glow, IsLessNoisyThanChance) {
  const std::string camera = R"(Film "rgb" "integer xresolution" 16 "integer yresolution" 16
PixelFilter "box" "float xradius" .5 "float yradius" .5
LookAt .6 -6 3  .6 0 0  0 0 1
Camera "perspective" "float fov" .5
WorldBegin
MakeNamedMedium "fire" "rgb sigma_a" [ 2 2 2 ] "rgb sigma_s" [ 0 0 0 ] "rgb Le" [ 6 6 6 ] "string type")",
                    grid = R"( "uniformgrid" "integer nx" 2 "integer ny" 2 "integer nz" 2
"point3 p0" [ -.2 -.2 .8 ] "point3 p1" [ .2 .2 1.2 ] "float density" [ 1 1 1 1 1 1 1 1 ])",
                    rest = R"(
AttributeBegin
MediumInterface "fire" ""
Material "interface"
Translate 0 0 1
Shape "sphere" "float radius" .1
AttributeEnd
Material "diffuse" "rgb reflectance" [ .6 .6 .6 ]
Shape "bilinearmesh" "point3 P" [ -4 -4 0  4 -4 0  -4 4 0  4 4 0 ]
)";
  const auto light = render_text(camera + grid + rest, 64, bounces(1, 0)),
             chance = render_text(camera + " \"homogeneous\"" + rest, 64, bounces(1, 0));
  EXPECT_GT(chance.mean().g, 0);
  EXPECT_LT(noise(light), noise(chance) / 2);
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
  EXPECT_FALSE(build_text(view + even_grid).scene->has_glow());
  const std::string cold =
      R"(MakeNamedMedium "fire" "string type" "uniformgrid" "integer nx" 2 "integer ny" 2 "integer nz" 2
"point3 p0" [ -1 -1 0 ] "point3 p1" [ 1 1 2 ] "float density" [ 1 1 1 1 1 1 1 1 ] "float temperature" [)";
  EXPECT_FALSE(build_text(view + cold + " 0 0 0 0 0 0 0 0 ]\n" + hall).scene->has_glow());
  EXPECT_TRUE(build_text(view + cold + " 0 0 0 0 0 0 3000 3000 ]\n" + hall).scene->has_glow());
}

}  // namespace
}  // namespace dapple::test
