// SPDX-License-Identifier: Apache-2.0
// Subsurface scattering in whole renders: the random walk conserves energy, diffusion agrees with it, and neither
// depends on caches or threads.
#include <gtest/gtest.h>

#include "dapple/base/parallel.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using distribution::DistributionIntegrator;
using integrate::RayList;
using test::build_text;
using test::expect_near;
using test::render_built;
using test::same_bits;

DistributionIntegrator::Settings settings(int bounces, int probes, bool cache = true) {
  DistributionIntegrator::Settings s;
  s.shading.bounces = bounces;
  s.shading.shadow_rays = RayList{16, 4};
  s.shading.diffuse_rays = RayList{16, 4};
  s.shading.subsurface_rays = probes;
  s.subsurface_cache = cache;
  return s;
}

std::string film(int size) {
  const std::string n = std::to_string(size);
  return "Film \"rgb\" \"integer xresolution\" " + n + " \"integer yresolution\" " + n + "\nPixelFilter \"box\"\n";
}

// A unit sphere that fills the picture, in light that `world` describes.
std::string sphere(const std::string& material, const std::string& world, int size = 12) {
  return film(size) + "LookAt 0 -4 0  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" 16\nWorldBegin\n" + world +
         "\nMaterial \"subsurface\" " + material + "\nShape \"sphere\" \"float radius\" 1\n";
}

constexpr const char* white_sky = "LightSource \"infinite\" \"rgb L\" [ 1 1 1 ]";

// Without absorption, all that is sent into a white furnace comes back: every pixel's expectation is 1. The deviation
// of a sample is below 1.5.
TEST(SubsurfaceWalk, FurnaceIsWhite) {
  for (const char* boundary : {"", "\"float roughness\" .1", "\"float eta\" 1",
                               "\"float eta\" 1.8 \"float roughness\" .5", "\"float g\" .7"}) {
    const auto built =
        build_text(sphere("\"rgb sigma_a\" [ 0 0 0 ] \"rgb sigma_s\" [ 4 4 4 ] " + std::string(boundary), white_sky));
    expect_near(render_built(built, 128, test::bounces(1)).mean(), 1, 0.012f, boundary);
  }
}

// Coefficients that differ by channel: the spectral draws are weighed right.
TEST(SubsurfaceWalk, FurnaceIsWhiteInEveryChannel) {
  const auto built = build_text(sphere("\"rgb sigma_a\" [ 0 0 0 ] \"rgb sigma_s\" [ 1 4 12 ]", white_sky));
  expect_near(render_built(built, 512, test::bounces(1)).mean(), 1, 0.02f, "furnace");
}

// Open bodies, and others inside: walks end, and what is inside is lit.
TEST(SubsurfaceWalk, OpenAndFilledBodiesEnd) {
  const std::string material = "Material \"subsurface\" \"rgb sigma_a\" [ 0 0 0 ] \"rgb sigma_s\" [ 2 2 2 ]\n";
  const std::string scene =
      film(12) + "LookAt 0 -4 0  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" 30\nWorldBegin\n" + white_sky +
      "\n" + material +
      "Shape \"sphere\" \"float radius\" 1\n"
      "Shape \"bilinearmesh\" \"point3 P\" [ -2 1.5 -2  2 1.5 -2  -2 1.5 2  2 1.5 2 ]\n"
      "Material \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\nShape \"sphere\" \"float radius\" .3\n";
  const RGB mean = test::render_text(scene, 32, test::bounces(2)).mean();
  EXPECT_GT(mean.g, 0.5f);
  EXPECT_LT(mean.g, 0.99f);
}

TEST(SubsurfaceDiffusion, FurnaceIsWhite) {
  for (const bool cache : {true, false})
    for (const char* eta : {"1", "1.33", "1.6"}) {
      const auto built = build_text(sphere(
          "\"rgb sigma_a\" [ 0 0 0 ] \"rgb sigma_s\" [ 100 200 400 ] \"float eta\" " + std::string(eta), white_sky));
      expect_near(render_built(built, 8, settings(1, 256, cache)).mean(), 1, 0.02f, eta);
    }
}

// Where diffusion holds, it agrees with the walk: a lit sphere of 250 free paths of radius.
TEST(SubsurfaceDiffusion, AgreesWithTheWalkOnASphere) {
  const std::string lamp =
      "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 5 5 5 ]\nTranslate -7 -9 6\nShape \"sphere\" \"float "
      "radius\" 5\nAttributeEnd\n";
  for (const char* boundary :
       {"\"float eta\" 1.33", "\"float eta\" 1.45 \"float roughness\" .3 \"bool remaproughness\" false"}) {
    const auto built = build_text(
        sphere("\"rgb reflectance\" [ .7 .5 .3 ] \"rgb mfp\" [ .004 .004 .004 ] " + std::string(boundary), lamp));
    expect_near(render_built(built, 16, settings(1, 128)).mean(), render_built(built, 2048, test::bounces(2)).mean(),
                0.05f, boundary);
  }
}

// A slab seen from above by parallel rays, so that columns are places; `z`: its lower side, `world`: its light.
std::string slab(const std::string& material, double depth, const std::string& world, int size) {
  const std::string z = std::to_string(-depth);
  return film(size) +
         "LookAt 0 0 .5  0 0 0  0 1 0\nCamera \"orthographic\" \"float screenwindow\" [ -.2 .2 -.2 .2 ]\nWorldBegin\n" +
         world + "\nMaterial \"subsurface\" " + material + "\nShape \"trianglemesh\" \"point3 P\" [ -1 -1 " + z +
         "  1 -1 " + z + "  1 1 " + z + "  -1 1 " + z +
         "  -1 -1 0  1 -1 0  1 1 0  -1 1 0 ] \"integer indices\" [ 4 5 6 4 6 7  0 2 1 0 3 2  0 1 5 0 5 4  1 2 6 1 6 5  "
         "2 3 7 2 7 6  3 0 4 3 4 7 ]\n";
}

std::vector<RGB> columns(const test::RenderedText& picture) {
  std::vector<RGB> sums(size_t(picture.film.width()));
  for (int x = 0; x < picture.film.width(); ++x) {
    for (int y = 0; y < picture.film.height(); ++y) sums[size_t(x)] += picture.film.pixel(x, y);
    sums[size_t(x)] *= 1.0f / float(picture.film.height());
  }
  return sums;
}

// Above the camera, half of parallel light is kept off: the picture is the profile, integrated over half a plane.
TEST(SubsurfaceDiffusion, SpreadsLightAcrossAShadowsEdgeAsTheWalkDoes) {
  const std::string half =
      "LightSource \"distant\" \"rgb L\" [ 3 3 3 ] \"point3 from\" [ 0 0 1 ] \"point3 to\" [ 0 0 0 ]\n"
      "Material \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\nShape \"bilinearmesh\" \"point3 P\" [ 0 -9 1  9 -9 1  0 9 1 "
      " 9 9 1 ]\n";
  const auto built =
      build_text(slab("\"rgb reflectance\" [ .7 .5 .3 ] \"rgb mfp\" [ .04 .04 .04 ] \"float roughness\" .3 \"bool "
                      "remaproughness\" false",
                      1, half, 16));
  const auto expected = columns(render_built(built, 4096, test::bounces(1)));
  auto s = settings(0, 256);
  s.shading_rate = 0.25f;
  const auto found = columns(render_built(built, 16, s));
  for (int c = 0; c < 3; ++c) {
    const float lit = expected[15][c];  // the camera's x runs the other way
    EXPECT_GT(lit, 5 * expected[0][c]);
    for (size_t x = 0; x < 16; ++x)
      EXPECT_NEAR(found[x][c], expected[x][c], 0.06f * lit) << "column " << x << ", channel " << c;
  }
}

TEST(SubsurfaceDiffusion, AgreesWithTheWalkOnASlab) {
  const auto built = build_text(
      slab("\"rgb reflectance\" [ .7 .5 .3 ] \"rgb mfp\" [ .01 .01 .01 ] \"float eta\" 1.4", 0.5, white_sky, 12));
  expect_near(render_built(built, 16, settings(1, 64)).mean(), render_built(built, 256, test::bounces(2)).mean(), 0.05f,
              "slab");
}

// Lit from behind: thin parts let light through, thick ones less. Flat diffusion is crude there: the order is right,
// and the trend.
TEST(SubsurfaceDiffusion, ThinPartsLetLightThrough) {
  const std::string below =
      "LightSource \"distant\" \"rgb L\" [ 3 3 3 ] \"point3 from\" [ 2 0 -1 ] \"point3 to\" [ 0 0 0 ]\n";
  float before = infinity;
  for (const double depth : {0.04, 0.08, 0.2}) {
    const auto built =
        build_text(slab("\"rgb reflectance\" [ .8 .8 .8 ] \"rgb mfp\" [ .02 .02 .02 ] \"float roughness\" .3 \"bool "
                        "remaproughness\" false",
                        depth, below, 8));
    const float walk = render_built(built, 1024, test::bounces(1)).mean().g,
                found = render_built(built, 4, settings(0, 512)).mean().g;
    EXPECT_GT(found, walk / 3) << depth;
    EXPECT_LT(found, walk * 3) << depth;
    EXPECT_LT(found, before);
    before = found;
  }
}

// A white body beside a red wall, in a room with one lamp: what the wall sends enters the body, and is spread there.
constexpr const char* room = R"(PixelFilter "box"
Film "rgb" "integer xresolution" 24 "integer yresolution" 24
LookAt 0 -3 1  0 0 .5  0 0 1
Camera "perspective" "float fov" 30
WorldBegin
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 8 8 8 ]
  Shape "bilinearmesh" "point3 P" [ 1 -1.5 2.5  1 -.5 2.5  2 -1.5 2.5  2 -.5 2.5 ]
  AttributeEnd
Material "diffuse" "rgb reflectance" [ .8 .1 .1 ]
Shape "bilinearmesh" "point3 P" [ -.7 -2 0  -.7 2 0  -.7 -2 2  -.7 2 2 ]
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
Shape "bilinearmesh" "point3 P" [ -2 -2 0  2 -2 0  -2 2 0  2 2 0 ]
Material "subsurface" "rgb reflectance" [ .8 .8 .8 ] "rgb mfp" [ .02 .02 .02 ] "float eta" 1.4
Translate 0 0 .5
Shape "sphere" "float radius" .5
)";

TEST(SubsurfaceDiffusion, TakesTheColourOfItsNeighbours) {
  const auto built = build_text(room);
  // Left half of the sphere.
  const auto redness = [](const test::RenderedText& r) {
    RGB sum;
    for (int y = 8; y < 16; ++y)
      for (int x = 6; x < 12; ++x) sum += r.film.pixel(x, y);
    return sum.r / sum.g;
  };
  const float direct = redness(render_built(built, 4, settings(0, 64)));
  const float cached = redness(render_built(built, 4, settings(2, 64))),
              computed = redness(render_built(built, 4, settings(2, 64, false)));
  EXPECT_NEAR(direct, 1, 0.02f);
  EXPECT_GT(cached, 1.05f);
  EXPECT_NEAR(cached, computed, 0.02f);
  EXPECT_NEAR(cached, redness(render_built(built, 512, test::bounces(3))), 0.06f);
}

TEST(SubsurfaceDiffusion, IsTheSameForAnyCacheAndThreads) {
  const auto built = build_text(room);
  auto s = settings(2, 16);
  set_thread_count(1);
  const auto whole = render_built(built, 2, s);
  for (const double mb : {0.0, 0.05, 100.0}) {
    s.cache_bytes = size_t(mb * (1 << 20));
    for (const int threads : {1, 2, 4}) {
      set_thread_count(threads);
      EXPECT_TRUE(same_bits(whole.film, render_built(built, 2, s).film)) << mb << " MB, " << threads << " threads";
    }
  }
  // Few probes, an odd number, none of the cache.
  s.shading.subsurface_rays = 5;
  s.subsurface_cache = false;
  const auto four = render_built(built, 2, s);
  set_thread_count(1);
  EXPECT_TRUE(same_bits(four.film, render_built(built, 2, s).film));
  set_thread_count(0);
}

TEST(SubsurfaceDiffusion, CountsLookUpsInCacheStatistics) {
  const auto built = build_text(room);
  const auto states = DistributionIntegrator(*built.scene, settings(1, 8)).caches();
  int found = 0;
  for (const auto& state : states) found += state.name.starts_with("irradiance.");
  EXPECT_EQ(found, 3);
}

// The walk, too, is the same for any number of threads.
TEST(SubsurfaceWalk, IsTheSameForAnyThreads) {
  const auto built = build_text(room);
  set_thread_count(1);
  const auto one = render_built(built, 4, test::bounces(2));
  set_thread_count(4);
  EXPECT_TRUE(same_bits(one.film, render_built(built, 4, test::bounces(2)).film));
  set_thread_count(0);
}

}  // namespace
}  // namespace dapple
