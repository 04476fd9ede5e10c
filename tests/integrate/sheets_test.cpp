// SPDX-License-Identifier: Apache-2.0
// Light that goes straight through clear sheets: panes, thin globes and boundaries between equal indices, against
// closed forms.
#include <gtest/gtest.h>

#include "dapple/base/parallel.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using distribution::DistributionIntegrator;
using test::build_text;
using test::expect_near;
using test::render_built;
using test::same_bits;

DistributionIntegrator::Settings distribution(int bounces, int rays = 64) {
  DistributionIntegrator::Settings s;
  s.shading.bounces = bounces;
  s.shading.shadow_rays = integrate::RayList{rays};
  s.shading.diffuse_rays = integrate::RayList{rays};
  return s;
}

// Fresnel's equations, the mean of both polarisations, then 1 - 2 F / (1 + F) for the two sides of a slab.
double pane_transmittance(double cosine, double ior) {
  const double inside = std::sqrt(1 - (1 - cosine * cosine) / (ior * ior));
  const double s = (cosine - ior * inside) / (cosine + ior * inside),
               p = (inside - ior * cosine) / (inside + ior * cosine);
  const double F = (s * s + p * p) / 2;
  return (1 - F) / (1 + F);
}

std::string film(int size) {
  const std::string n = std::to_string(size);
  return "Film \"rgb\" \"integer xresolution\" " + n + " \"integer yresolution\" " + n + "\nPixelFilter \"box\"\n";
}

// A spot of .002 of a floor of reflectance 1, seen from just above; `world` lies higher.
std::string spot(const std::string& world,
                 const std::string& floor = "Material \"diffuse\" \"rgb reflectance\" [ 1 1 1 ]") {
  return film(4) +
         "LookAt 0 0 .5  0 0 0  0 1 0\nCamera \"orthographic\" \"float screenwindow\" [ -.001 .001 -.001 .001 "
         "]\nWorldBegin\n" +
         floor + "\nShape \"bilinearmesh\" \"point3 P\" [ -5 -5 0  5 -5 0  -5 5 0  5 5 0 ]\n" + world;
}

std::string pane(double z, const std::string& material = "Material \"thindielectric\" \"float eta\" 1.5") {
  const std::string at = " " + std::to_string(z) + " ";
  return material + "\nShape \"bilinearmesh\" \"point3 P\" [ -50 -50" + at + " 50 -50" + at + " -50 50" + at +
         " 50 50" + at + "]\n";
}

void expect_both(const std::string& scene, double value, float error, const std::string& what, int samples = 16) {
  const auto built = build_text(scene);
  expect_near(render_built(built, samples, test::bounces(0)).mean(), RGB(float(value)), error, "path, " + what);
  expect_near(render_built(built, 4, distribution(0)).mean(), RGB(float(value)), error, "distribution, " + what);
}

// Lights without extent: E = T I cos^3 / h^2, T the panes' transmittance at that angle. Nothing is random but the
// places in the pixel.
TEST(Sheets, LetLightsWithoutExtentThrough) {
  for (const double x : {0.0, 2.0, 6.0, 20.0}) {
    const double h = 2, cosine = h / std::sqrt(h * h + x * x), T = pane_transmittance(cosine, 1.5);
    const std::string light =
        "LightSource \"point\" \"rgb I\" [ 10 10 10 ] \"point3 from\" [ " + std::to_string(x) + " 0 2 ]\n";
    const double bare = 10 * std::pow(cosine, 3) / (h * h) / pi;
    expect_both(spot(light + pane(1)), bare * T, 2e-3f, "one pane, x = " + std::to_string(x));
    expect_both(spot(light + pane(1) + pane(1.2) + pane(1.3)), bare * T * T * T, 2e-3f,
                "three panes, x = " + std::to_string(x));
    expect_both(spot(light + pane(1, "Material \"dielectric\" \"float eta\" 1")), bare, 2e-3f,
                "equal indices, x = " + std::to_string(x));
  }
  const std::string sun =
      "LightSource \"distant\" \"rgb L\" [ 3 3 3 ] \"point3 from\" [ 1.7320508 0 1 ] \"point3 to\" [ 0 0 0 ]\n";
  expect_both(spot(sun + pane(1)), 3 * .5 * pane_transmittance(.5, 1.5) / pi, 2e-3f, "sun at 60 degrees");
}

// A pane that is cut out, tinted or partly something else: the share of it that is there keeps light off by 1 - T.
TEST(Sheets, VaryOverTheSurface) {
  const std::string light = "LightSource \"point\" \"rgb I\" [ 10 10 10 ] \"point3 from\" [ 0 0 2 ]\n";
  const double bare = 2.5 / pi, T = pane_transmittance(1, 1.5);
  const std::string glass = pane(1);
  const auto with = [&](const std::string& parameter) { return glass.substr(0, glass.size() - 1) + parameter + "\n"; };
  // A mean of 0 or T: with 64 rays at 16 places the standard deviation is 1.7 %; the path's 4096 samples, the same.
  // Four of these.
  const std::string mix =
      "MakeNamedMaterial \"glass\" \"string type\" \"thindielectric\"\nMakeNamedMaterial \"black\" \"string type\" "
      "\"diffuse\" \"rgb reflectance\" "
      "[ 0 0 0 ]\nMaterial \"mix\" \"string materials\" [ \"glass\" \"black\" ] \"float amount\" .5";
  expect_both(spot(light + pane(1, mix)), bare * T / 2, .07f, "half glass", 256);
  expect_both(spot(light + with(" \"float alpha\" .5")), bare * (1 + T) / 2, .07f, "half there", 256);
  // Over all a bump map leaves light straight; where the normal is bent by less than 6 degrees T stays within .1 %.
  expect_both(spot("Texture \"waves\" \"float\" \"wrinkled\"\nTexture \"low\" \"float\" \"scale\" \"texture tex\" "
                   "\"waves\" \"float scale\" .001\n" +
                   light + pane(1, "Material \"thindielectric\" \"texture displacement\" \"low\"")),
              bare * T, 3e-3f, "bumps");
}

// Under a sky of radiance 1 and an endless pane a diffuse floor's radiance is T's mean over the projected hemisphere,
// by 1000 midpoints. The path's two strategies share it: a wrong density behind the pane would count light twice or not
// at all.
TEST(Sheets, ShareLightWithThePathsThatGoStraight) {
  double mean = 0;
  for (int i = 0; i < 1000; ++i) mean += pane_transmittance(std::sqrt((i + .5) / 1000), 1.5) / 1000;
  const std::string sky = "LightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\n";
  const std::string wide = "Material \"thindielectric\"\nShape \"sphere\" \"float radius\" 1000\n";
  expect_both(spot(sky + pane(.6, "Material \"thindielectric\"")), mean, .012f, "sky", 1024);
  // In the middle of a large globe all light is met at right angles, whatever the floor's gloss; specular depth 0
  // leaves out what the globe reflects.
  auto path = test::bounces(0);
  auto rays = distribution(0);
  path.specular_depth = rays.shading.specular_depth = 0;
  for (const char* roughness : {".05", ".3"}) {
    const std::string metal =
        std::string("Material \"conductor\" \"float roughness\" ") + roughness + " \"bool remaproughness\" false";
    const auto bare = build_text(spot(sky, metal)), behind = build_text(spot(sky + wide, metal));
    const float T = float(pane_transmittance(1, 1.5));
    expect_near(render_built(behind, 1024, path).mean(), render_built(bare, 1024, path).mean() * T, .01f, roughness);
    expect_near(render_built(behind, 16, rays).mean(), render_built(bare, 16, rays).mean() * T, .015f, roughness);
  }
}

// A lamp of radius .01 in the middle of a thin globe of radius .2, and one in two such globes: the globes send what
// they reflect back to the lamp, which is black. So light is that of the bare lamp times T of right angles, within .3 %
// for the lamp's size.
TEST(Sheets, LampsInThinGlobesLightRooms) {
  const std::string lamp =
      "AttributeBegin\nTranslate .5 0 2\nMaterial \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\nAreaLightSource "
      "\"diffuse\" \"rgb L\" [ 9000 9000 9000 ]\n"
      "Shape \"sphere\" \"float radius\" .01\nAttributeEnd\n";
  const auto globe = [](const char* radius) {
    return std::string(
               "AttributeBegin\nTranslate .5 0 2\nMaterial \"thindielectric\"\nShape \"sphere\" \"float radius\" ") +
           radius + "\nAttributeEnd\n";
  };
  const double cosine = 2 / std::sqrt(4.25), E = 9000 * pi * 1e-4 * cosine / 4.25, T = pane_transmittance(1, 1.5);
  expect_both(spot(lamp), E / pi, .01f, "bare");
  expect_both(spot(lamp + globe(".2")), E * T / pi, .01f, "in a globe");
  expect_both(spot(lamp + globe(".2") + globe(".4")), E * T * T / pi, .01f, "in two");
}

// Absorbing fog between two panes: times exp(-sigma d / cos).
TEST(Sheets, KeepMediaApart) {
  const std::string fog =
      "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [ 1 1 1 ] \"rgb sigma_s\" [ 0 0 0 ]\n";
  const std::string light = "LightSource \"point\" \"rgb I\" [ 10 10 10 ] \"point3 from\" [ 0 0 2 ]\n";
  const std::string two = "AttributeBegin\nMediumInterface \"fog\" \"\"\n" + pane(1) +
                          "AttributeEnd\nAttributeBegin\nMediumInterface \"\" \"fog\"\n" + pane(1.5) + "AttributeEnd\n";
  const double T = pane_transmittance(1, 1.5);
  const auto built = build_text(spot(fog + light + two));
  const float value = float(2.5 / pi * T * T), mean = render_built(built, 4, test::bounces(0)).mean().g;
  // Which side of a sheet is inside follows its corners' order.
  EXPECT_NEAR(mean, value * std::exp(-.5f), .003f * value);
  EXPECT_NEAR(render_built(built, 4, distribution(0)).mean().g, mean, .003f * value);
}

// Specular depth does not count what goes straight, as it does not count passing what is not there.
TEST(Sheets, DoNotCountAsScatterings) {
  const std::string sky = "LightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\n";
  const auto built =
      build_text(spot(sky + pane(.6, "Material \"thindielectric\"") + pane(.7, "Material \"thindielectric\"")));
  auto none = test::bounces(0);
  none.specular_depth = 0;
  const float deep = render_built(built, 256, test::bounces(0)).mean().g;
  EXPECT_NEAR(render_built(built, 256, none).mean().g, deep, .015f * deep);
}

TEST(Sheets, AreTheSameForAnyThreads) {
  const auto built = build_text(film(24) + R"(LookAt 0 -1.9 1  0 0 1  0 0 1
Camera "perspective" "float fov" 75
WorldBegin
LightSource "infinite" "rgb L" [ .5 .7 1 ]
Shape "bilinearmesh" "point3 P" [ -2 -2 0  2 -2 0  -2 2 0  2 2 0 ]
Shape "bilinearmesh" "point3 P" [ -2 -2 2  2 -2 2  -2 2 2  2 2 2 ]
MakeNamedMaterial "glass" "string type" "thindielectric"
MakeNamedMaterial "grey" "string type" "diffuse"
Material "mix" "string materials" [ "glass" "grey" ] "float amount" .3
Shape "bilinearmesh" "point3 P" [ -2 2 0  2 2 0  -2 2 2  2 2 2 ]
)");
  for (const bool path : {true, false}) {
    const auto render = [&] {
      return path ? render_built(built, 4, test::bounces(2)) : render_built(built, 4, distribution(2, 4));
    };
    set_thread_count(1);
    const auto one = render();
    set_thread_count(4);
    EXPECT_TRUE(same_bits(one.film, render().film)) << path;
    set_thread_count(0);
  }
}

}  // namespace
}  // namespace dapple
