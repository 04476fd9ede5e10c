// SPDX-License-Identifier: Apache-2.0
// Light shaders: the examples against closed forms, in both integrators, and plug-ins that are broken.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/plugins/rendered.h"

namespace dapple::test {
namespace {

constexpr double pi = std::numbers::pi;
const char* const integrators[] = {"path", "distribution"};

std::string spot(const std::string& file, const std::string& parameters) {
  return "LightSource \"spot\" \"point3 from\" [ 0 0 2 ] \"point3 to\" [ 0 0 0 ] \"float coneangle\" 60 \"float "
         "conedeltaangle\" 0 \"string shader\" \"" +
         file + "\" " + parameters + "\n";
}

// Grey of 1/2 under a source of 1 W/sr, 2 above: radiance 1/2 / pi h / (x^2 + y^2 + h^2)^(3/2).
double unshaded(double x, double y) {
  return 0.5 / pi * 2 / std::pow(x * x + y * y + 4, 1.5);
}

// Pixels are seen from the other side than the light's picture: x to the left for both, y up.
TEST(BarnDoors, CutARectangle) {
  const std::string light = spot(
      examples + "/libbarn_doors.so",
      R"("float left" .4 "float right" .1 "float top" .3 "float bottom" .2 "float soft" 0 "rgb filter" [ 1 .5 0 ])");
  for (const char* integrator : integrators) {
    const Rendered r = render_scene(view + light + plane, {"--strict"}, integrator);
    ASSERT_EQ(r.run.exit_code, 0) << r.run.output;
    for (int py = 0; py < 64; ++py)
      for (int px = 0; px < 64; ++px) {
        const double x = 1 - (px + 0.5) / 32, y = 1 - (py + 0.5) / 32;
        // The light's right is at -x. Pixels within one of an edge hold both.
        const double inside = std::min({x + 2 * 0.1, 2 * 0.4 - x, y + 2 * 0.2, 2 * 0.3 - y});
        if (std::abs(inside) < 0.04) continue;
        const double expected = inside > 0 ? unshaded(x, y) : 0;
        ASSERT_NEAR(r.picture.at(px, py)[0], expected, 0.01 * expected) << integrator << " " << px << " " << py;
        ASSERT_NEAR(r.picture.at(px, py)[1], 0.5 * expected, 0.01 * expected);
        ASSERT_EQ(r.picture.at(px, py)[2], 0);
      }
  }
}

// Soft edges let through as much as sharp ones: s-shaped, half at the edge. By quadrature of the formula.
TEST(BarnDoors, SoftEdges) {
  const auto step = [](double d) {
    const double t = std::clamp(d / 0.2 + 0.5, 0.0, 1.0);
    return t * t * (3 - 2 * t);
  };
  double expected = 0;
  for (int j = 0; j < 400; ++j)
    for (int i = 0; i < 400; ++i) {
      const double x = (i + 0.5) / 200 - 1, y = (j + 0.5) / 200 - 1;
      expected +=
          unshaded(x, y) * step(0.2 - x / 2) * step(0.2 + x / 2) * step(0.2 - y / 2) * step(0.2 + y / 2) / 160000;
    }
  const std::string light =
      spot(examples + "/libbarn_doors.so",
           R"("float left" .2 "float right" .2 "float top" .2 "float bottom" .2 "float soft" .2)");
  for (const char* integrator : integrators)
    EXPECT_NEAR(render_scene(view + light + plane, {}, integrator).mean[0], expected, 0.005 * expected) << integrator;
}

// A lamp of side .04, 1 above, with tubes as long as wide: radiance 1/2 / pi L A cos^4 / h^2 times the overlap of two
// circles of diameter 1 whose middles are tan(theta) apart.
TEST(Honeycomb, LetsThroughWhatGoesAlongIt) {
  const std::string lamp =
      "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [ 1000 1000 1000 ] \"string shader\" \"" + examples +
      "/libhoneycomb.so\" \"float depth\" 1\nReverseOrientation Shape \"bilinearmesh\" \"point3 P\" [ -.02 -.02 1  .02 "
      "-.02 1  -.02 .02 1  .02 .02 1 ]\n"
      "AttributeEnd\n";
  for (const char* integrator : integrators) {
    const Rendered r = render_scene(view + lamp + plane, {"--strict", "--shadow-rays", "16"}, integrator);
    ASSERT_EQ(r.run.exit_code, 0) << r.run.output;
    for (const int px : {35, 40, 46, 50, 54, 60}) {
      const double x = (px + 0.5) / 32 - 1, y = (20.5) / 32 - 1, t = std::sqrt(x * x + y * y),
                   c = 1 / std::sqrt(1 + t * t);
      const double passes = t < 1 ? 2 / pi * (std::acos(t) - t * std::sqrt(1 - t * t)) : 0;
      const double expected = 0.5 / pi * 1000 * 0.0016 * std::pow(c, 4) * passes;
      EXPECT_NEAR(r.picture.at(px, 20)[1], expected, 0.02 * expected + 0.0003) << integrator << " " << px;
    }
  }
}

// In directions of positive x; the picture's left half.
TEST(LightFaults, AreStoodInForCountedAndNamed) {
  for (const char* integrator : integrators) {
    const Rendered thrown =
        render_scene(view + spot(modules + "/liblight_probe.so", "\"string fault\" \"throw\"") + plane, {}, integrator);
    EXPECT_EQ(thrown.run.exit_code, 3);
    expect_contains(thrown.run.output,
                    "scene.pbrt:8:1: light shader \"light probe\" of liblight_probe.so: emission threw at ");
    expect_contains(thrown.run.output, "no light here");
    ASSERT_EQ(thrown.picture.width, 64);
    EXPECT_GT(thrown.picture.at(16, 32)[0], 0.01f);
    EXPECT_EQ(thrown.picture.at(16, 32)[1], 0);
    const double expected = unshaded(-0.515625, -0.015625);
    EXPECT_NEAR(thrown.picture.at(48, 32)[1], expected, 0.01 * expected);

    for (const char* fault : {"nan", "negative"}) {
      const std::string light = spot(modules + "/liblight_probe.so", std::string("\"string fault\" \"") + fault + "\"");
      const Rendered r = render_scene(view + light + plane, {}, integrator);
      EXPECT_EQ(r.run.exit_code, 0) << r.run.output;
      expect_contains(r.run.output, "emission gave values that are wrong at ");
      EXPECT_EQ(r.picture.at(16, 32)[1], 0);
      EXPECT_GT(r.picture.at(48, 32)[1], 0.01f);
      EXPECT_EQ(render_scene(view + light + plane, {"--strict"}, integrator).run.exit_code, 3);
    }
  }
}

struct Refused {
  const char* name;
  std::string world;
  const char* said;
};

TEST(LightFaults, WhatCannotBeUsedIsRefusedAtItsPlace) {
  for (const Refused& c :
       {Refused{"missing", spot("libabsent.so", ""), "No such file"},
        Refused{"factory", spot(modules + "/liblight_probe.so", "\"string fault\" \"factory\""),
                "the factory is closed"},
        Refused{"name", spot(modules + "/libown_name.so", ""), "declares \"scale\""},
        Refused{"material", spot(modules + "/libprobe.so", ""), "is for materials; expected one for a light"},
        Refused{"light", "Material \"plugin\" \"string filename\" \"" + modules + "/liblight_probe.so\"\n",
                "is for lights; expected one for a material"}}) {
    const Rendered r = render_scene(view + c.world + plane, {}, "path");
    EXPECT_EQ(r.run.exit_code, 3) << c.name;
    expect_contains(r.run.output, "scene.pbrt:8:");
    expect_contains(r.run.output, c.said);
    EXPECT_EQ(render_scene(view + c.world + plane, {"--keep-going"}, "path").run.exit_code, 0) << c.name;
  }
  const ProcessResult info = run_dapple({"plugin-info", examples + "/libbarn_doors.so"}, 60);
  EXPECT_EQ(info.exit_code, 0);
  expect_contains(info.output, "emission, of a light");
}

}  // namespace
}  // namespace dapple::test
