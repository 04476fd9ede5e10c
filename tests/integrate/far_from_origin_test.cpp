// SPDX-License-Identifier: Apache-2.0
// Scenes far from the origin are those at the origin: coordinates are moved in double precision before they become
// single.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/support/render_text.h"

namespace dapple {
namespace {

using distribution::DistributionIntegrator;
using path::PathIntegrator;

std::string number(double v) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g ", v);
  return text;
}
std::string point(const V3d& by, double x, double y, double z) {
  return number(by.x + x) + number(by.y + y) + number(by.z + z);
}

enum class Where { in_transforms, in_points, in_definitions };

// A floor, a ball, a leaf that is instanced, a lamp, a spot and a grid of haze, under a sky; the camera looks down on
// them.
std::string scene(const V3d& by, Where where) {
  const V3d points = where == Where::in_points ? by : V3d(0, 0, 0);
  const std::string move = where == Where::in_points ? "" : "Translate " + point(by, 0, 0, 0) + "\n";
  const std::string mesh = "Shape \"trianglemesh\" \"point3 P\" [ " + point(points, -5, -5, 0) +
                           point(points, 5, -5, 0) + point(points, 5, 5, 0) + point(points, -5, 5, 0) +
                           "] \"integer indices\" [ 0 1 2 0 2 3 ]\n";
  const V3d definition = where == Where::in_definitions ? by : V3d(0, 0, 0);  // far out; instances bring it back
  std::string text = "LookAt " + point(by, 0, -6, 4) + point(by, 0, 0, .3) + R"( 0 0 1
Camera "perspective" "float fov" 30
Film "rgb" "integer xresolution" 32 "integer yresolution" 32
PixelFilter "box"
WorldBegin
LightSource "distant" "point3 from" [ 1 2 3 ] "point3 to" [ 0 0 0 ]
LightSource "infinite" "rgb L" [ .3 .3 .3 ]
AttributeBegin
)" + move + R"(
LightSource "point" "rgb I" [ 2 1 1 ] "point3 from" [ )" +
                     point(points, 1, 1, 2) + R"( ]
LightSource "spot" "rgb I" [ 1 2 1 ] "point3 from" [ )" +
                     point(points, -1, 1, 2) + "] \"point3 to\" [ " + point(points, 0, 0, 0) + R"( ]
AttributeEnd
AttributeBegin
Translate )" + point(by, 0, 0, 0) +
                     R"(
Texture "checks" "spectrum" "checkerboard" "string mapping" "planar" "vector3 v1" [ 1 0 0 ] "vector3 v2" [ 0 1 0 ] "rgb tex1" [ .8 .2 .2 ] "rgb tex2" [ .2 .2 .8 ]
AttributeEnd
ObjectBegin "leaf"
Material "diffusetransmission"
AttributeBegin
Translate )" + point(definition, 0, 0, 0) +
                     R"(
Shape "trianglemesh" "point3 P" [ 0 0 0 .8 0 .4 0 .8 .4 ] "integer indices" [ 0 1 2 ]
AttributeEnd
ObjectEnd
AttributeBegin
)" + move + "Material \"diffuse\" \"rgb reflectance\" [ .5 .5 .5 ]\n" +
                     mesh + R"(
AreaLightSource "diffuse" "rgb L" [ 3 3 3 ]
Shape "bilinearmesh" "point3 P" [ )" +
                     point(points, -1, 2, 1) + point(points, 1, 2, 1) + point(points, -1, 2, 2) +
                     point(points, 1, 2, 2) + R"( ]
AttributeEnd
)";
  const auto placed = [&](double x, double y, double z, const std::string& what) {
    return "AttributeBegin\nTranslate " + point(by, x, y, z) + "\n" + what + "\nAttributeEnd\n";
  };
  text += placed(-1, 0, .5,
                 "Material \"diffuse\" \"texture reflectance\" \"checks\"\nShape \"sphere\" \"float radius\" .5");
  text += placed(.3, -1, .9, "Rotate 40 0 1 0\nTranslate " + point(-definition, 0, 0, 0) + "\nObjectInstance \"leaf\"");
  text += placed(1, 0, .6,
                 "MakeNamedMedium \"m\" \"string type\" \"uniformgrid\" \"integer nx\" 1 \"integer ny\" 1 \"integer "
                 "nz\" 2 \"float density\" [ 1 2 ] \"point3 p0\" [ -1 -1 -1 ] \"point3 p1\" [ 1 1 1 ]\n"
                 "MediumInterface \"m\" \"\"\nMaterial \"interface\"\nShape \"sphere\" \"float radius\" .5");
  return text;
}

double block_error(const scene::Film& a, const scene::Film& b) {
  double sum = 0, mean = 0;
  for (int y = 0; y < 32; y += 8)
    for (int x = 0; x < 32; x += 8) {
      double p = 0, q = 0;
      for (int i = 0; i < 64; ++i)
        p += double(a.pixel(x + i % 8, y + i / 8).g) / 64, q += double(b.pixel(x + i % 8, y + i / 8).g) / 64;
      sum += (p - q) * (p - q) / 16, mean += q / 16;
    }
  return std::sqrt(sum) / mean;
}

template <class Settings>
void expect_the_same(const Settings& settings, const char* name) {
  const auto origin = test::render_text(scene(V3d(0, 0, 0), Where::in_transforms), 64, settings);
  for (const Where where : {Where::in_transforms, Where::in_points, Where::in_definitions})
    for (const double distance : {1e3, 1e4, 1e5, 1e6, 1e7, 1e8}) {
      // No round numbers: what is rounded shows.
      const auto moved =
          test::render_text(scene(V3d(distance * 0.537, distance * 1.013, distance * 1e-4), where), 64, settings);
      const std::string what =
          std::string(name) + ", " + std::to_string(int(where)) + ", by " + std::to_string(distance);
      test::expect_near(moved.mean(), origin.mean(), 1e-3f, what);
      EXPECT_LE(block_error(moved.film, origin.film), 0.01) << what;
    }
}

TEST(FarFromOrigin, PathIsTheSame) {
  PathIntegrator::Settings s;
  s.diffuse_bounces = 1;
  expect_the_same(s, "path");
}

TEST(FarFromOrigin, DistributionIsTheSame) {
  DistributionIntegrator::Settings s;
  s.shading.bounces = 1;
  s.shading.shadow_rays = {16};
  s.shading.diffuse_rays = {16};
  expect_the_same(s, "distribution");
}

}  // namespace
}  // namespace dapple
