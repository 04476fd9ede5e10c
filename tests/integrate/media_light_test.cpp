// SPDX-License-Identifier: Apache-2.0
// Light in media against the path tracer: what glows lights surfaces, and fog scatters into all kinds of rays, more
// than once.
#include <gtest/gtest.h>

#include "dapple/base/parallel.h"
#include "tests/support/render_text.h"

namespace dapple::test {
namespace {

using distribution::DistributionIntegrator;

const std::string view = R"(Film "rgb" "integer xresolution" 32 "integer yresolution" 32
PixelFilter "box" "float xradius" .5 "float yradius" .5
LookAt 0 -3 1  0 0 .7  0 0 1
)";
const std::string walls = R"(
Material "diffuse" "rgb reflectance" [ .6 .6 .6 ]
Shape "bilinearmesh" "point3 P" [ -4 -4 0  4 -4 0  -4 4 0  4 4 0 ]
Material "diffuse" "rgb reflectance" [ .6 .2 .2 ]
Shape "bilinearmesh" "point3 P" [ -4 2 0  4 2 0  -4 2 4  4 2 4 ]
)";

// A ball of gas that does not scatter is the only light.
const std::string glow = view + R"(Camera "perspective" "float fov" 60
WorldBegin
MakeNamedMedium "gas" "string type" "homogeneous" "rgb sigma_a" [ 1 1 1 ] "rgb sigma_s" [ 0 0 0 ] "rgb Le" [ 8 3 .5 ]
AttributeBegin
  MediumInterface "gas" ""
  Material "interface"
  Translate -.9 .4 1.2
  Shape "sphere" "float radius" .8
AttributeEnd
AttributeBegin
  Material "conductor" "float roughness" .2
  Translate .9 .4 .5
  Shape "sphere" "float radius" .45
AttributeEnd
)" + walls;

// A lamp in fog, beside a mirror.
const std::string fog = view + R"(
MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_a" [ .02 .05 .1 ] "rgb sigma_s" [ .4 .3 .2 ] "float g" .3
MediumInterface "" "fog"
Camera "perspective" "float fov" 60
WorldBegin
MediumInterface "fog" "fog"
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 20 20 20 ]
  Translate 1 -1 3
  Shape "sphere" "float radius" .5
AttributeEnd
Material "conductor" "float roughness" 0
Shape "bilinearmesh" "point3 P" [ .3 1 .2  1.2 .6 .2  .3 1 1.4  1.2 .6 1.4 ]
)" + walls;

struct Room {
  const char* name;
  const std::string* text;
  int path_samples, samples;
};

class MediaLight : public testing::TestWithParam<Room> {};

DistributionIntegrator::Settings with_cache(bool cache) {
  DistributionIntegrator::Settings s;
  s.radiosity_cache = cache;
  s.shading.bounces = 1;
  s.shading.specular_depth = 8;
  s.shading.shadow_rays = {4};
  s.shading.diffuse_rays = {16, cache ? 8 : 1};
  return s;
}

TEST_P(MediaLight, AgreesWithPath) {
  const auto built = build_text(*GetParam().text);
  const RGB expected = render_built(built, GetParam().path_samples, bounces(1, 8)).mean();
  for (const bool cache : {false, true}) {
    const RGB mean = render_built(built, GetParam().samples, with_cache(cache)).mean();
    expect_near(mean, expected, .02f, cache ? "cached" : "uncached");
  }
}

TEST_P(MediaLight, IsTheSameForAnyNumberOfThreadsAndAnyCache) {
  const auto built = build_text(*GetParam().text);
  auto s = with_cache(true);
  s.irradiance_interpolation = true;
  const auto whole = render_built(built, 2, s);
  set_thread_count(1);
  s.cache_bytes = 0;
  const auto alone = render_built(built, 2, s);
  set_thread_count(0);
  EXPECT_TRUE(same_bits(whole.film, alone.film));
}

// Probes scatter nowhere in fog: what other rays did there before, which depends on what else is in the picture, is
// none of their light.
TEST(MediaAndSubsurface, DoNotMixUpTheirRays) {
  const std::string text = fog + R"(Material "subsurface" "rgb reflectance" [ .8 .5 .3 ] "rgb mfp" [ .1 .1 .1 ]
Translate -.5 0 .6
Shape "sphere" "float radius" .6
)";
  build::BuildOptions part;
  part.film.crop = Box2i(V2i(4, 8), V2i(20, 24));
  const auto whole = render_built(build_text(text), 2, with_cache(true)),
             alone = render_built(build_text(text, part), 2, with_cache(true));
  for (int y = 8; y < 24; ++y)
    for (int x = 4; x < 20; ++x) ASSERT_EQ(whole.film.pixel(x, y), alone.film.pixel(x, y)) << x << " " << y;
}

INSTANTIATE_TEST_SUITE_P(Rooms, MediaLight,
                         testing::Values(Room{"glow", &glow, 1024, 64}, Room{"fog", &fog, 1024, 100}),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace dapple::test
