// SPDX-License-Identifier: Apache-2.0
// Volumes given by pattern programs, in both integrators.
#include <gtest/gtest.h>

#include "dapple/base/parallel.h"
#include "dapple/media/pattern_medium.h"
#include "tests/support/render_text.h"

namespace dapple::test {
namespace {

using distribution::DistributionIntegrator;

// A lamp over a floor, in a box of the medium "fog" that takes up the whole room.
std::string room(const std::string& fog, const std::string& reflectance = ".5") {
  return R"(Film "rgb" "integer xresolution" 32 "integer yresolution" 32
PixelFilter "box" "float xradius" .5 "float yradius" .5
LookAt 0 -3 1  0 0 .7  0 0 1
Camera "perspective" "float fov" 60
WorldBegin
)" + fog +
         R"(
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 20 20 20 ]
  Translate 1 -2 3.2
  Shape "sphere" "float radius" .5
AttributeEnd
AttributeBegin
  Material "interface"
  MediumInterface "fog" ""
  Shape "bilinearmesh" "point3 P" [ -1 0 .1  1 0 .1  -1 0 1.5  1 0 1.5 ]
  Shape "bilinearmesh" "point3 P" [ 1 1 .1  -1 1 .1  1 1 1.5  -1 1 1.5 ]
  Shape "bilinearmesh" "point3 P" [ -1 1 .1  -1 0 .1  -1 1 1.5  -1 0 1.5 ]
  Shape "bilinearmesh" "point3 P" [ 1 0 .1  1 1 .1  1 0 1.5  1 1 1.5 ]
  Shape "bilinearmesh" "point3 P" [ -1 1 .1  1 1 .1  -1 0 .1  1 0 .1 ]
  Shape "bilinearmesh" "point3 P" [ -1 0 1.5  1 0 1.5  -1 1 1.5  1 1 1.5 ]
AttributeEnd
Material "diffuse" "rgb reflectance" [ )" +
         reflectance + " " + reflectance + " " + reflectance + R"( ]
Shape "bilinearmesh" "point3 P" [ -4 -4 0  4 -4 0  -4 4 0  4 4 0 ]
Shape "bilinearmesh" "point3 P" [ -4 4 0  4 4 0  -4 4 4  4 4 4 ]
)";
}

const std::string coefficients =
    R"("rgb sigma_a" [ .1 .2 .5 ] "rgb sigma_s" [ 2 1.5 1 ] "float g" .4 "rgb Le" [ .2 .1 0 ])";
const std::string homogeneous = "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" " + coefficients;
const std::string constant =
    "MakeNamedMedium \"fog\" \"string type\" \"pattern\" \"point3 p0\" [ -9 -9 -9 ] \"point3 p1\" [ 9 9 9 ] " +
    coefficients;
const std::string patterns = R"(
Texture "noise" "float" "fbm" "integer octaves" 3
Texture "cloud" "float" "remap" "texture in" "noise" "float inlow" -1 "float inhigh" 1 "float outlow" 0 "float outhigh" 2
Texture "kept" "float" "clamp" "texture in" "cloud" "float low" 0 "float high" 2
Texture "glow" "spectrum" "combine3" "texture in1" "kept" "float in2" .05 "float in3" .1
Texture "tint" "spectrum" "combine3" "float in1" 2 "texture in2" "kept" "float in3" 1
)";
std::string medium(const std::string& rest) {
  return patterns + R"(MakeNamedMedium "fog" "string type" "pattern" "point3 p0" [ -9 -9 -9 ] "point3 p1" [ 9 9 9 ]
  "texture density" "kept" "float maxdensity" 2 "rgb sigma_a" [ .1 .2 .5 ] "float g" .4 )" +
         rest;
}
const std::string clouds = medium("\"texture sigma_s\" \"tint\" \"float maxsigma_s\" 2"),
                  glowing = medium("\"rgb sigma_s\" [ 0 0 0 ] \"texture Le\" \"glow\"");

DistributionIntegrator::Settings single_scattering() {
  DistributionIntegrator::Settings s;
  s.radiosity_cache = false;
  s.shading.bounces = 0;
  s.shading.specular_depth = 0;
  s.shading.shadow_rays = {8};
  s.shading.diffuse_rays = {1};
  return s;
}

TEST(PatternMedia, ConstantOnesAreHomogeneous) {
  const auto uneven = build_text(room(constant)), even = build_text(room(homogeneous));
  expect_near(render_built(uneven, 256, bounces(1, 8)).mean(), render_built(even, 256, bounces(1, 8)).mean(), .01f,
              "path");
  expect_near(render_built(uneven, 256, single_scattering()).mean(),
              render_built(even, 256, single_scattering()).mean(), .01f, "distribution");
}

// Single scattering with shadows is what the path tracer does where nothing may follow.
TEST(PatternMedia, DistributionAgainstPath) {
  const auto built = build_text(room(clouds));
  const RGB mean = render_built(built, 256, single_scattering()).mean();
  const RGB expected = render_built(built, 576, bounces(0, 0)).mean();
  expect_near(mean, expected, .01f, "clouds");
  // Glow, which camera rays alone see: nothing here is lit by it.
  const auto glow = build_text(room(glowing, "0"));
  expect_near(render_built(glow, 256, single_scattering()).mean(), render_built(glow, 256, bounces(0, 0)).mean(), .01f,
              "glow");
  const auto without = build_text(room("MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"float scale\" 0"));
  const RGB clear = render_built(without, 64, bounces(0, 0)).mean();
  EXPECT_GT(std::abs(mean.b - clear.b), .02f * clear.b);  // there is something to see
  for (const auto& medium : built.scene->media)
    EXPECT_TRUE(media::medium_faults({medium}).empty()) << media::medium_faults({medium})[0];
}

// Rays go through the patterns in other batches for another number of threads.
TEST(PatternMedia, AreTheSameForAnyNumberOfThreads) {
  const auto built = build_text(room(clouds));
  auto s = single_scattering();
  s.shading.bounces = 1;
  const auto grids = render_built(built, 4, s);
  const auto paths = render_built(built, 4, bounces(2, 8));
  set_thread_count(1);
  const auto grids_alone = render_built(built, 4, s);
  const auto paths_alone = render_built(built, 4, bounces(2, 8));
  set_thread_count(0);
  EXPECT_TRUE(same_bits(grids.film, grids_alone.film));
  EXPECT_TRUE(same_bits(paths.film, paths_alone.film));
}

}  // namespace
}  // namespace dapple::test
