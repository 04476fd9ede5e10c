// SPDX-License-Identifier: Apache-2.0
// Irradiance interpolation in whole renders.
#include <fmt/format.h>
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
using test::room;
using test::same_bits;
using test::two_rooms;

DistributionIntegrator::Settings settings(bool interpolate, int rays = 144) {
  DistributionIntegrator::Settings s;
  s.shading.bounces = 2;
  s.shading.shadow_rays = RayList{4, 2};
  s.shading.diffuse_rays = RayList{rays, 8};
  s.irradiance_interpolation = interpolate;
  return s;
}

/// Root mean square difference from a, by a's own.
double difference(const scene::Film& a, const scene::Film& b) {
  double sum = 0, whole = 0;
  for (int y = 0; y < a.height(); ++y)
    for (int x = 0; x < a.width(); ++x) {
      const RGB d = a.pixel(x, y) - b.pixel(x, y);
      sum += sqr(d.r) + sqr(d.g) + sqr(d.b), whole += sqr(a.pixel(x, y).luminance()) * 3;
    }
  return std::sqrt(sum / whole);
}

TEST(IrradianceInterpolation, AgreesWithThePathTracer) {
  const auto built = build_text(room);
  const RGB expected = render_built(built, 1024, test::bounces(2, 8)).mean();
  expect_near(render_built(built, 16, settings(true)).mean(), expected, 0.02f, "room");
}

TEST(IrradianceInterpolation, CountsTheGlowOfFogOnce) {
  std::string text = R"(MediumInterface "" "fog"
LookAt 0 -2.8 .5  0 2 -.5  0 0 1
Camera "perspective" "float fov" 70
Film "rgb" "integer xresolution" 32 "integer yresolution" 24 "bool savefp16" false
MakeNamedMedium "fog" "string type" "exponential" "float scaleheight" 4 "rgb sigma_a" [ .02 .02 .02 ] "rgb sigma_s" [ 0 0 0 ] "rgb Le" [ 4 4 4 ]
WorldBegin
MediumInterface "fog" "fog"
LightSource "infinite" "rgb L" [ .5 .5 .5 ]
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
)";
  for (const char* P :
       {"-3 -3 -2  3 -3 -2  -3 3 -2  3 3 -2", "-3 -3 2  3 -3 2  -3 3 2  3 3 2", "-3 3 -2  3 3 -2  -3 3 2  3 3 2",
        "-3 -3 -2  -3 3 -2  -3 -3 2  -3 3 2", "3 -3 -2  3 3 -2  3 -3 2  3 3 2", "-3 -3 -2  3 -3 -2  -3 -3 2  3 -3 2"})
    text += "Shape \"bilinearmesh\" \"point3 P\" [ " + std::string(P) + " ]\n";
  const auto fog = build_text(text);
  auto dense = settings(false), sparse = settings(true);
  for (auto* s : {&dense, &sparse}) s->shading.bounces = 1;
  const RGB without = render_built(fog, 4, dense).mean();
  const auto with = render_built(fog, 4, sparse);
  expect_near(with.mean(), without, 0.02f, "glow");
}

// 48 x 48 pixels are few for a room with eight things in it; larger pictures save more (bench/radiosity).
TEST(IrradianceInterpolation, SavesDiffuseRays) {
  const auto built = build_text(room);
  auto dense = settings(false), sparse = settings(true);
  for (auto* s : {&dense, &sparse}) s->shading.bounces = 1, s->shading_rate = 0.05f;
  const auto without = render_built(built, 4, dense), with = render_built(built, 4, sparse);
  EXPECT_LT(2 * with.result.rays.diffuse, without.result.rays.diffuse);
  expect_near(with.mean(), without.mean(), 0.01f, "of the same points");
}

TEST(IrradianceInterpolation, DoesNotLeakThroughAWall) {
  const RGB there = render_built(build_text(two_rooms(-1)), 8, settings(true)).mean();
  EXPECT_LT(render_built(build_text(two_rooms(1)), 8, settings(true)).mean().luminance(), 1e-4f * there.luminance());
}

// Plates in the sun throw spots on a ceiling. Few rays of a hemisphere find them, and of four that agree all may have
// missed them.
TEST(IrradianceInterpolation, KeepsGlints) {
  std::string scene = R"(Film "rgb" "integer xresolution" 48 "integer yresolution" 48
PixelFilter "box"
LookAt 0 2 1  0 2 3  0 1 0
Camera "perspective" "float fov" 60
WorldBegin
LightSource "infinite" "rgb L" [ .05 .05 .05 ]
LightSource "distant" "point3 from" [ 0 -1 1 ] "point3 to" [ 0 0 0 ] "rgb L" [ 3 3 3 ]
Material "diffuse" "rgb reflectance" [ .8 .8 .8 ]
Shape "bilinearmesh" "point3 P" [ -4 0 3  -4 4 3  4 0 3  4 4 3 ]
Material "diffuse" "rgb reflectance" [ .05 .05 .05 ]
Shape "bilinearmesh" "point3 P" [ -9 -9 0  9 -9 0  -9 9 0  9 9 0 ]
MATERIAL
)";
  for (int i = 0; i < 9; ++i)
    scene += fmt::format(
        "AttributeBegin\nTranslate {} {} .3\nShape \"bilinearmesh\" \"point3 P\" [ -.1 -.1 0  .1 -.1 0  -.1 .1 0  .1 "
        ".1 0 ]\nAttributeEnd\n",
        (i % 3 - 1) * 1.2, (i / 3) * 0.8 - 1.6);
  for (
      const char* material :
      {R"(Material "conductor" "rgb reflectance" [ .9 .9 .9 ] "bool remaproughness" false "float roughness" .1)",
       R"(Material "coateddiffuse" "rgb reflectance" [ .05 .05 .05 ] "float eta" 3 "bool remaproughness" false "float roughness" .1)"}) {
    std::string text = scene;
    const auto built = build_text(text.replace(text.find("MATERIAL"), 8, material));
    auto dense = settings(false, 1024), sparse = settings(true, 1024);
    for (auto* s : {&dense, &sparse}) s->shading.bounces = 1, s->irradiance_accuracy = 0.25f;
    const RGB without = render_built(built, 4, dense).mean(), with = render_built(built, 4, sparse).mean();
    expect_near(with, without, 0.03f, material);
  }
}

// Between a red and a green wall, bumps of the floor show which they face. What hemispheres over a smooth floor say of
// each bump must show the same.
TEST(IrradianceInterpolation, BumpsShow) {
  const auto floor = [](const char* bumps) {
    return build_text(std::string(R"(Film "rgb" "integer xresolution" 48 "integer yresolution" 48
PixelFilter "box"
LookAt 0 0 2  0 0 0  0 1 0
Camera "perspective" "float fov" 40
WorldBegin
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 20 20 20 ]
  Shape "bilinearmesh" "point3 P" [ -2.5 -1 2  -2.5 -1 3  -2.5 1 2  -2.5 1 3 ]
  AreaLightSource "diffuse" "rgb L" [ 20 20 20 ]
  Shape "bilinearmesh" "point3 P" [ 2.5 -1 3  2.5 -1 2  2.5 1 3  2.5 1 2 ]
AttributeEnd
Material "diffuse" "rgb reflectance" [ .8 .05 .05 ]
Shape "bilinearmesh" "point3 P" [ -4 -4 0  -4 4 0  -4 -4 4  -4 4 4 ]
Material "diffuse" "rgb reflectance" [ .05 .8 .05 ]
Shape "bilinearmesh" "point3 P" [ 4 -4 0  4 4 0  4 -4 4  4 4 4 ]
Texture "hills" "float" "fbm" "integer octaves" 1
Texture "waves" "float" "scale" "texture tex" "hills" "float scale" .25
)") + bumps + R"(
Shape "bilinearmesh" "point3 P" [ -4 -4 0  4 -4 0  -4 4 0  4 4 0 ]
)");
  };
  const auto smooth = floor(R"(Material "diffuse" "rgb reflectance" [ .5 .5 .5 ])");
  const auto bumpy = floor(R"(Material "diffuse" "rgb reflectance" [ .5 .5 .5 ] "texture displacement" "waves")");
  auto dense = settings(false, 1024), sparse = settings(true, 1024);
  for (auto* s : {&dense, &sparse}) s->shading.bounces = 1, s->shading.shadow_rays = RayList{16, 4};
  const auto expected = render_built(bumpy, 4, dense), shown = render_built(bumpy, 4, sparse);
  EXPECT_GT(difference(expected.film, render_built(smooth, 4, dense).film), 0.1);
  // What gradients do not carry from bump to bump, noise, and the shadow terminator of bent normals, which they know on
  // average only: .058.
  EXPECT_LT(difference(expected.film, shown.film), 0.065);
  EXPECT_LT(2 * shown.result.rays.diffuse, expected.result.rays.diffuse);
}

// A wall, bare but for what a lit board behind the eye sends: few rays of a hemisphere meet it, and one that serves
// many points is one wrong value for all of them.
TEST(IrradianceInterpolation, WideHemispheresAreNotBlotches) {
  const auto built = build_text(R"(Film "rgb" "integer xresolution" 96 "integer yresolution" 96
PixelFilter "box"
LookAt 0 0 0  0 0 1  0 1 0
Camera "perspective" "float fov" 60
WorldBegin
LightSource "spot" "point3 from" [ 0 0 -1 ] "point3 to" [ 0 0 -4 ] "float coneangle" 60 "rgb I" [ 50 50 50 ]
Material "diffuse" "rgb reflectance" [ .8 .8 .8 ]
Shape "bilinearmesh" "point3 P" [ -3 -3 4  -3 3 4  3 -3 4  3 3 4 ]
Shape "bilinearmesh" "point3 P" [ -1.5 -1.5 -4  1.5 -1.5 -4  -1.5 1.5 -4  1.5 1.5 -4 ]
)");
  auto dense = settings(false, 1024), sparse = settings(true, 64);
  for (auto* s : {&dense, &sparse}) s->shading.bounces = 1, s->irradiance_accuracy = 0.5f;
  const auto expected = render_built(built, 4, dense);
  double off = 0;
  constexpr int seeds = 4;
  for (uint64_t seed = 0; seed < seeds; ++seed) {
    sparse.shading.seed = seed;
    const auto shown = render_built(built, 4, sparse);
    EXPECT_LT(4 * shown.result.rays.diffuse, expected.result.rays.diffuse / 16);
    off += difference(expected.film, shown.film) / seeds;
  }
  EXPECT_LT(off, 0.12);
}

TEST(IrradianceInterpolation, OfAnyMemoryAndThreadsGivesTheSameImage) {
  const auto built = build_text(room);
  auto s = settings(true, 20);
  s.shading.bounces = 1;  // without memory every look-up is a hemisphere
  const auto whole = render_built(built, 1, s);
  for (const size_t bytes : {size_t(0), size_t(20000), size_t(1) << 30}) {
    s.cache_bytes = bytes;
    for (const int threads : {1, 4}) {
      set_thread_count(threads);
      EXPECT_TRUE(same_bits(whole.film, render_built(built, 1, s).film))
          << bytes << " bytes, " << threads << " threads";
    }
  }
  set_thread_count(0);
}

TEST(IrradianceInterpolation, AnyNumberOfRaysIsAHemisphere) {
  const auto built = build_text(room);
  for (const int rays : {1, 3, 255, 700}) {
    auto s = settings(true, rays);
    s.shading.bounces = 1;
    const RGB mean = render_built(built, 1, s).mean();
    EXPECT_TRUE(mean.is_finite() && mean.min() > 0) << rays;
  }
}

}  // namespace
}  // namespace dapple
