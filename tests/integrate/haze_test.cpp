// SPDX-License-Identifier: Apache-2.0
// Which medium surfaces lie in that name none: distribution against the path tracer, whose paths carry their medium,
// and a closed form.
#include <gtest/gtest.h>

#include "tests/support/render_text.h"

namespace dapple::test {
namespace {

using distribution::DistributionIntegrator;

const std::string film = R"(Film "rgb" "integer xresolution" 32 "integer yresolution" 24
PixelFilter "box" "float xradius" .5 "float yradius" .5
MakeNamedMedium "haze" "string type" "homogeneous" "rgb sigma_s" [ .06 .06 .06 ] "rgb sigma_a" [ .02 .03 0 ]
MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_s" [ .2 .2 .2 ] "rgb sigma_a" [ .1 .1 .2 ]
)";
const std::string lights = R"(LightSource "distant" "rgb L" [ 3 3 3 ] "point3 from" [ .3 1 .6 ] "point3 to" [ 0 0 0 ]
LightSource "infinite" "rgb L" [ .1 .14 .2 ]
)";
const std::string things = R"(Material "diffuse" "rgb reflectance" [ .4 .3 .2 ]
Shape "bilinearmesh" "point3 P" [ -9 -9 0  9 -9 0  -9 9 0  9 9 0 ]
Material "diffusetransmission" "rgb reflectance" [ .1 .2 .05 ] "rgb transmittance" [ .1 .3 .05 ]
Shape "trianglemesh" "point3 P" [ -2 0 0  1 0 0  -.5 .5 2 ] "integer indices" [ 0 1 2 ]
Shape "trianglemesh" "point3 P" [ 1 1 0  3 1 .5  2 1.5 2 ] "integer indices" [ 0 1 2 ]
)";
std::string ball(const std::string& media, float radius, const std::string& at = "0 0 0") {
  return "AttributeBegin\nMediumInterface " + media + "\nMaterial \"interface\"\nTranslate " + at +
         "\nShape \"sphere\" \"float radius\" " + std::to_string(radius) + "\nAttributeEnd\n";
}
const std::string far_camera = "LookAt 0 -16 3  0 0 1  0 0 1\nCamera \"perspective\" \"float fov\" 30\n";
const std::string near_camera = "LookAt 0 -6 2  0 0 .5  0 0 1\nCamera \"perspective\" \"float fov\" 50\n";

struct Haze {
  const char* name;
  std::string text;
};

std::ostream& operator<<(std::ostream& out, const Haze& haze) {
  return out << haze.name;
}

std::vector<Haze> scenes() {
  const std::string world = "WorldBegin\n" + lights, in_haze = "MediumInterface \"\" \"haze\"\n",
                    in_none = "MediumInterface \"\" \"\"\n";
  return {
      {"outside", film + far_camera + world + ball("\"haze\" \"\"", 12) + things},
      {"inside", film + in_haze + near_camera + world + in_none + ball("\"haze\" \"\"", 12) + things},
      {"half", film + far_camera + world + ball("\"haze\" \"\"", 4, "2 0 0") + things},
      {"nested", film + far_camera + world + ball("\"haze\" \"\"", 12) + ball("\"fog\" \"haze\"", 2) + things},
      {"between", film + in_haze + near_camera + world + in_none + ball("\"haze\" \"\"", 12) +
                      ball("\"fog\" \"haze\"", 2, "0 2 1") + things},
      {"inherited", film + near_camera + in_haze + world + ball("\"haze\" \"\"", 12) + things},
      {"undeclared", film + near_camera + world + ball("\"haze\" \"\"", 12) + things},
      {"glass", film + far_camera + world + things +
                    "AttributeBegin\nMediumInterface \"fog\" \"\"\nMaterial \"dielectric\"\nTranslate 0 -2 2\n" +
                    "Shape \"sphere\" \"float radius\" 1.8\nAttributeEnd\nMaterial \"diffuse\"\nTranslate 0 -2 2\n" +
                    "Shape \"sphere\" \"float radius\" 1\n"},
  };
}

DistributionIntegrator::Settings settings(int diffuse_bounces) {
  DistributionIntegrator::Settings s;
  s.shading.bounces = diffuse_bounces;
  s.shading.shadow_rays = {64, 8};
  s.shading.diffuse_rays = {128, 16};
  return s;
}

class SurfacesInHaze : public testing::TestWithParam<Haze> {};

// 1 %, the noise of the path tracer in it.
TEST_P(SurfacesInHaze, AreLitAsByPaths) {
  const auto built = build_text(GetParam().text);
  for (const int n : {0, 3})
    expect_near(render_built(built, 16, settings(n)).mean(), render_built(built, 2048, bounces(n, 16)).mean(), .01f,
                std::to_string(n));
}

INSTANTIATE_TEST_SUITE_P(Scenes, SurfacesInHaze, testing::ValuesIn(scenes()),
                         [](const auto& tested) { return std::string(tested.param.name); });

// Seen from above under a light above: light goes twice through h = sqrt(R^2 - r^2) of the ball. With a = 2 sigma the
// mean of exp(-a h) over its disk is 2 (1 - exp(-a R) (1 + a R)) / (a R)^2. One grid of shading points is half in and
// half out.
TEST(AbsorbingBall, OverAFloor) {
  const std::string text = R"(Film "rgb" "integer xresolution" 48 "integer yresolution" 48
PixelFilter "box" "float xradius" .5 "float yradius" .5
LookAt 0 0 10  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ -3 3 -3 3 ]
MakeNamedMedium "smoke" "string type" "homogeneous" "rgb sigma_s" [ 0 0 0 ] "rgb sigma_a" [ .3 .3 .3 ]
WorldBegin
LightSource "distant" "rgb L" [ 3 3 3 ] "point3 from" [ 0 0 1 ] "point3 to" [ 0 0 0 ]
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
Shape "bilinearmesh" "point3 P" [ -9 -9 0  9 -9 0  -9 9 0  9 9 0 ]
)" + ball("\"smoke\" \"\"", 2);
  const double aR = 2 * 0.3 * 2, disk = 4 * double(pi) / 36;
  const double passed = 1 - disk + disk * 2 * (1 - std::exp(-aR) * (1 + aR)) / (aR * aR);
  const float expected = float(3 * 0.5 / double(pi) * passed);
  const auto built = build_text(text);
  expect_near(render_built(built, 64, bounces(0)).mean(), expected, .01f, "path");
  expect_near(render_built(built, 16, settings(0)).mean(), expected, .01f, "distribution");
  expect_near(render_built(built, 16, settings(3)).mean(), expected, .01f, "distribution, three bounces");
}

// As in pbrt-v4: a surface that is not there does not shine, which is said once.
TEST(InterfaceLamps, DoNotShine) {
  for (const std::string material : {"interface", "none", ""}) {
    Diagnostics diagnostics;
    const std::string lamp = "Shape \"sphere\" \"float radius\" .2\n";
    const auto description = scenefile::parse_pbrt("Camera \"perspective\"\nWorldBegin\nMaterial \"" + material +
                                                       "\"\nAreaLightSource \"diffuse\" \"rgb L\" [ 5 5 5 ]\n" + lamp +
                                                       "Translate 1 0 0\n" + lamp,
                                                   "test.pbrt", ".", diagnostics);
    const auto built = build::build_scene(description, {}, diagnostics);
    EXPECT_TRUE(built.scene->lights.empty()) << material;
    int said = 0;
    for (const std::string& m : diagnostics.messages())
      said += m.find("test.pbrt:5:") != std::string::npos && m.find("nothing shines") != std::string::npos;
    EXPECT_EQ(said, 1) << material;
  }
}

}  // namespace
}  // namespace dapple::test
