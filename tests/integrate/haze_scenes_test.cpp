// SPDX-License-Identifier: Apache-2.0
// Haze seen from several places; grids and homogeneous media under transforms.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/render_text.h"

namespace dapple {
namespace {

using distribution::DistributionIntegrator;
using path::PathIntegrator;
using test::build_text;
using test::render_built;

DistributionIntegrator::Settings cached(int bounces) {
  DistributionIntegrator::Settings s;
  s.shading.bounces = bounces;
  s.shading.caustics = true;
  return s;
}

std::string film(int w, int h) {
  return "Film \"rgb\" \"integer xresolution\" " + std::to_string(w) + " \"integer yresolution\" " + std::to_string(h) +
         "\nPixelFilter \"box\"\n";
}

// An absorbing ball of radius 2 around a floor of albedo .5, lit and seen straight from above: radiance is (.5 / pi) E
// exp(-2 sigma h), h = sqrt(4 - r^2) inside the ball. The floor is one quad that the ball's edge crosses. Means over
// the picture of 6 x 6: within 1 %.
TEST(Haze, AbsorbingBallOverAFloor) {
  constexpr double sigma = 0.4, radius = 2, half = 3;
  double right = 0;
  constexpr int n = 1000;
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      const double r2 = std::pow(half * (2 * (x + 0.5) / n - 1), 2) + std::pow(half * (2 * (y + 0.5) / n - 1), 2);
      right += 0.5 * std::exp(-2 * sigma * std::sqrt(std::max(radius * radius - r2, 0.0))) / (n * n);
    }
  const auto built = build_text(film(48, 48) + R"(
LookAt 0 0 10  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ -3 3 -3 3 ]
MakeNamedMedium "haze" "string type" "homogeneous" "rgb sigma_a" [ .4 .4 .4 ] "rgb sigma_s" [ 0 0 0 ]
WorldBegin
LightSource "distant" "rgb L" [ 3.14159265 3.14159265 3.14159265 ] "point3 from" [ 0 0 1 ] "point3 to" [ 0 0 0 ]
AttributeBegin
MediumInterface "haze" ""
Material "interface"
Shape "sphere" "float radius" 2
AttributeEnd
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
Shape "bilinearmesh" "point3 P" [ -8 -8 0  8 -8 0  -8 8 0  8 8 0 ]
)");
  PathIntegrator::Settings path;
  path.diffuse_bounces = 0;
  test::expect_near(render_built(built, 64, path).mean(), float(right), 0.01f, "path");
  test::expect_near(render_built(built, 16, cached(0)).mean(), float(right), 0.01f, "distribution");
}

struct Place {
  const char* name;
  std::string camera, more;
};

// Leaves and a floor in a ball of haze, seen from outside, from inside, between two media, and with glass full of fog
// and nested balls beside: means of `distribution` and `path` agree within 1 %, direct and with three bounces. The
// noise of 1024 samples of 24 x 18 pixels is in it (with 2048 the largest difference is .5 %).
TEST(Haze, DistributionIsPath) {
  const std::string outside = "LookAt 0 -16 3  0 0 1  0 0 1\nCamera \"perspective\" \"float fov\" 30\n";
  const std::string inside =
      "LookAt 0 -6 2  0 0 1  0 0 1\nMediumInterface \"\" \"haze\"\nCamera \"perspective\" \"float fov\" "
      "50\nMediumInterface \"\" \"\"\n";
  const std::string nested = R"(
AttributeBegin
MediumInterface "smoke" "haze"
Material "interface"
Translate 0 0 1
Shape "sphere" "float radius" 2
AttributeEnd
)";
  const std::string glass = R"(
AttributeBegin
MediumInterface "smoke" "haze"
Material "dielectric"
Translate 1 -2 1
Shape "sphere" "float radius" 1
AttributeEnd
)";
  const std::string inherited = "MediumInterface \"\" \"haze\"\n";
  for (const Place& place : {Place{"outside", outside, ""},
                             {"inside", inside, ""},
                             {"between two media", inside, nested},
                             {"nested, from outside", outside, nested},
                             {"glass full of smoke", outside, glass},
                             {"inherited", inside, inherited}}) {
    const std::string text = film(24, 18) + R"(
MakeNamedMedium "haze" "string type" "homogeneous" "rgb sigma_s" [ .06 .06 .06 ] "rgb sigma_a" [ 0 0 0 ]
MakeNamedMedium "smoke" "string type" "homogeneous" "rgb sigma_s" [ .1 .1 .1 ] "rgb sigma_a" [ .3 .3 .2 ]
)" + place.camera + R"(
WorldBegin
LightSource "distant" "rgb L" [ 3 3 3 ] "point3 from" [ .3 1 .6 ] "point3 to" [ 0 0 0 ]
LightSource "infinite" "rgb L" [ .3 .34 .4 ]
AttributeBegin
MediumInterface "haze" ""
Material "interface"
Shape "sphere" "float radius" 12
AttributeEnd
)" + place.more + R"(
Material "diffuse" "rgb reflectance" [ .4 .3 .2 ]
Shape "bilinearmesh" "point3 P" [ -9 -9 0  9 -9 0  -9 9 0  9 9 0 ]
Material "diffusetransmission" "rgb reflectance" [ .1 .2 .05 ] "rgb transmittance" [ .1 .3 .05 ]
Shape "bilinearmesh" "point3 P" [ -2 1 .5  -1 1.5 .5  -2 1 2  -1 1 2 ]
Shape "bilinearmesh" "point3 P" [ 2 -1 .8  1 -1.5 .8  2 1 1  1 1 2 ]
)";
    const auto built = build_text(text);
    for (const int bounces : {0, 3}) {
      PathIntegrator::Settings path;
      path.diffuse_bounces = bounces;
      const RGB right = render_built(built, 1024, path).mean();
      DistributionIntegrator::Settings settings = cached(bounces);
      settings.shading.shadow_rays = {16};
      settings.shading.diffuse_rays = {64, 16};
      test::expect_near(render_built(built, 64, settings).mean(), right, 0.01f,
                        std::string(place.name) + ", " + std::to_string(bounces) + " bounces");
    }
  }
}

// Area lights where there is no surface: no lamp in any integrator, and a warning, once.
TEST(Haze, LampsOfNoSurface) {
  for (const std::string material : {"interface", "none", ""}) {
    const std::string text = film(16, 16) +
                             "LookAt 0 -3 1  0 0 .5  0 0 1\nCamera \"perspective\" \"float fov\" 40\nWorldBegin\n" + R"(
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
Shape "bilinearmesh" "point3 P" [ -2 -2 0 2 -2 0 -2 2 0 2 2 0 ]
Material ")" + material + R"("
AreaLightSource "diffuse" "rgb L" [ 5 5 5 ]
Translate 0 0 .7
Shape "sphere" "float radius" .2
Shape "sphere" "float radius" .1
)";
    Diagnostics diagnostics;
    const auto description = scenefile::parse_pbrt(text, "test.pbrt", ".", diagnostics);
    const auto built = build::build_scene(description, {}, diagnostics);
    EXPECT_TRUE(built.scene->lights.empty()) << material;
    int said = 0;
    for (const auto& warning : diagnostics.messages()) said += warning.find("nothing shines") != std::string::npos;
    EXPECT_EQ(said, 1) << material;
    EXPECT_EQ(render_built(built, 4, PathIntegrator::Settings{}).mean().max(), 0);
    EXPECT_EQ(render_built(built, 4, cached(1)).mean().max(), 0);
  }
}

// A grid of density 1 and absorption .5 in a ball of diameter 2: exp(-1) comes through its middle whatever the grid's
// transform, as through a homogeneous medium.
TEST(Haze, GridsAreOfTheWorldsUnits) {
  std::string ones;
  for (int i = 0; i < 64; ++i) ones += "1 ";
  std::string none;
  for (int i = 0; i < 64; ++i) none += "0 ";
  for (const std::string transform : {"", "Scale 4 4 4", "Scale .5 3 8", "Rotate 30 1 2 3 Scale 2 2 -2"}) {
    for (const std::string& medium :
         {"\"string type\" \"uniformgrid\" \"rgb sigma_a\" [ .5 .5 .5 ] \"rgb sigma_s\" [ 0 0 0 ] \"integer nx\" 4 "
          "\"integer ny\" 4 \"integer nz\" 4 \"float density\" [ " +
              ones + "]",
          "\"string type\" \"rgbgrid\" \"rgb sigma_a\" [ " + ones + ones + ones + "] \"rgb sigma_s\" [ " + none + none +
              none + "] \"float scale\" .5 \"integer nx\" 4 \"integer ny\" 4 \"integer nz\" 4",
          std::string("\"string type\" \"homogeneous\" \"rgb sigma_a\" [ .5 .5 .5 ] \"rgb sigma_s\" [ 0 0 0 ]")}) {
      const std::string text = film(4, 4) +
                               "LookAt 0 0 5  0 0 0  0 1 0\nCamera \"orthographic\" \"float screenwindow\" [ -.02 .02 "
                               "-.02 .02 ]\nWorldBegin\n" +
                               R"(
LightSource "infinite" "rgb L" [ 1 1 1 ]
AttributeBegin
)" + transform + "\nMakeNamedMedium \"m\" " +
                               medium + R"( "point3 p0" [ -9 -9 -9 ] "point3 p1" [ 9 9 9 ]
AttributeEnd
MediumInterface "m" ""
Material "interface"
Shape "sphere" "float radius" 1
)";
      test::expect_near(test::render_text(text, 2048, PathIntegrator::Settings{}).mean(), std::exp(-1.0f), 0.01f,
                        transform + " " + medium.substr(0, 40));
    }
  }
}

}  // namespace
}  // namespace dapple
