// SPDX-License-Identifier: Apache-2.0
// Normal maps and vertex normals in whole renders: `path` and `distribution` have one rule.
#include <gtest/gtest.h>

#include <cmath>

#include "dapple/image/image_writer.h"
#include "tests/image/temporary_folder.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using distribution::DistributionIntegrator;
using path::PathIntegrator;

DistributionIntegrator::Settings cached(int bounces) {
  DistributionIntegrator::Settings s;
  s.shading.bounces = bounces;
  s.shading.shadow_rays = {16};
  s.shading.diffuse_rays = {64, 16};
  return s;
}

// Waves of slopes to 39 degrees, along u.
void write_waves(const std::string& path) {
  image::OutputImage out;
  out.width = out.height = 64;
  std::vector<float> pixels;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      const float slope = std::tan(39 * pi / 180) * std::sin(2 * pi * (float(x) + 0.5f) / 16);
      const float length = std::sqrt(1 + slope * slope);
      for (const float n : {slope / length, 0.0f, 1 / length}) pixels.push_back(0.5f + 0.5f * n);
    }
  out.layers = {{"", {"R", "G", "B"}, std::move(pixels), {}}};
  image::write_exr(path, out);
}

// Seen from 15, 30 and 60 degrees above the floor, in sun and sky, with one bounce from a wall. Bound: 1 %, the noise
// of both in it (largest .8 %, seen from 60 degrees).
TEST(BentFloors, DistributionIsPath) {
  const test::TemporaryFolder folder;
  write_waves(folder.file("waves.exr"));
  for (const char* material : {"diffuse", "coateddiffuse", "diffusetransmission"})
    for (const float angle : {15.0f, 30.0f, 60.0f}) {
      const float y = -20 * std::cos(angle * pi / 180), z = 20 * std::sin(angle * pi / 180);
      const std::string text = "LookAt 0 " + std::to_string(y) + " " + std::to_string(z) + R"(  0 0 0  0 0 1
Camera "orthographic" "float screenwindow" [ -1 1 -.25 .25 ]
Film "rgb" "integer xresolution" 128 "integer yresolution" 32
PixelFilter "box"
WorldBegin
LightSource "distant" "rgb L" [ 2 2 2 ] "point3 from" [ .8 .3 .5 ] "point3 to" [ 0 0 0 ]
LightSource "infinite" "rgb L" [ .5 .5 .5 ]
Material ")" + material + R"(" "string normalmap" ")" +
                               folder.file("waves.exr") + R"("
Shape "trianglemesh" "point3 P" [ -20 -20 0 20 -20 0 20 20 0 -20 20 0 ] "point2 uv" [ 0 0 40 0 40 40 0 40 ] "integer indices" [ 0 1 2 0 2 3 ]
Material "diffuse" "rgb reflectance" [ .6 .5 .4 ]
Shape "bilinearmesh" "point3 P" [ -5 4 0  5 4 0  -5 4 3  5 4 3 ]
)";
      const auto built = test::build_text(text);
      PathIntegrator::Settings path;
      path.diffuse_bounces = 1;
      const RGB right = test::render_built(built, 256, path).mean();
      test::expect_near(test::render_built(built, 16, cached(1)).mean(), right, 0.01f,
                        std::string(material) + " from " + std::to_string(int(angle)));
    }
}

// An opaque sheet with vertex normals bent by 37 degrees, and more than 90: dark behind; .5 cos t in front, from
// wherever it is seen (t < 90). A sun of irradiance pi.
TEST(BentFloors, SheetsAreOpaqueAndDiffuse) {
  for (const char* normals : {".6 0 .8", "-.6 0 -.8"})
    for (const char* eye : {"-1 .1 .3", "1 .1 .3", "0 .1 1", "-1 .1 -.3", "1 .1 -.3"})
      for (const char* material :
           {"\"diffuse\" \"rgb reflectance\" [ .5 .5 .5 ]",
            "\"diffusetransmission\" \"rgb reflectance\" [ .5 .5 .5 ] \"rgb transmittance\" [ 0 0 0 ]"}) {
        const std::string n = std::string(normals) + " ";
        const std::string text = std::string("LookAt ") + eye + R"(  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ -.1 .1 -.1 .1 ]
Film "rgb" "integer xresolution" 8 "integer yresolution" 8
WorldBegin
LightSource "distant" "rgb L" [ 3.14159265 3.14159265 3.14159265 ] "point3 from" [ 0 0 1 ] "point3 to" [ 0 0 0 ]
Material )" + material + R"(
Shape "trianglemesh" "point3 P" [ -1 -1 0 1 -1 0 1 1 0 -1 1 0 ] "normal N" [ )" +
                                 n + n + n + n + "] \"integer indices\" [ 0 1 2 0 2 3 ]\n";
        const bool in_front = std::string(eye).find("-.3") == std::string::npos;
        const auto built = test::build_text(text);
        const std::string what = std::string(normals) + " from " + eye;
        PathIntegrator::Settings path;
        path.diffuse_bounces = 0;
        const RGB traced = test::render_built(built, 16, path).mean(),
                  shaded = test::render_built(built, 16, cached(0)).mean();
        EXPECT_NEAR(traced.g, in_front ? 0.4f : 0, 2e-3f) << what;
        EXPECT_NEAR(shaded.g, in_front ? 0.4f : 0, 2e-3f) << what;
      }
}

}  // namespace
}  // namespace dapple
