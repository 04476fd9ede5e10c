// SPDX-License-Identifier: Apache-2.0
// Shader plug-ins as users meet them: the examples against closed forms, and plug-ins that are broken in every way.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/plugins/rendered.h"

namespace dapple::test {
namespace {

constexpr double pi = std::numbers::pi;

const std::string head = view + "LightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\n";

std::string plugin(const std::string& file, const std::string& parameters) {
  return "Material \"plugin\" \"string filename\" \"" + file + "\" " + parameters + "\n";
}
std::string probe(const std::string& parameters) {
  return plugin(modules + "/libprobe.so", parameters);
}

Rendered render_world(const std::string& world, const std::vector<std::string>& options = {},
                      const std::string& integrator = "distribution") {
  return render_scene(head + world, options, integrator);
}

// Under a white sky a sphere of reflectance 0.6 has radiance 0.6, which of three tones becomes 2/3. Seen from afar, the
// cosine at radius r is sqrt(1 - r^2): the line covers the share w^2 of the disk.
TEST(Toon, TonesAndLineOfASphere) {
  const double w = 0.4, disk = pi / 4;
  const Rendered r =
      render_world(plugin(examples + "/libtoon.so",
                          R"("rgb reflectance" [ .6 .6 .6 ] "integer tones" 3 "float rim" .4 "rgb ink" [ 3 0 0 ])") +
                       "Shape \"sphere\" \"float radius\" 1\n",
                   {"--resolution", "256x256"});
  ASSERT_EQ(r.run.exit_code, 0) << r.run.output;
  EXPECT_NEAR(r.mean[0], (1 - disk) + disk * ((1 - w * w) * 2 / 3 + w * w * 3), 4e-3);
  EXPECT_NEAR(r.mean[1], (1 - disk) + disk * (1 - w * w) * 2 / 3, 4e-3);
}

// What the viewer sees of a wall of ink, the floor beside it does not receive: it is lit as by a grey wall.
TEST(Toon, OtherSurfacesReceiveLightWithoutTheEffect) {
  const std::string wall = "Shape \"bilinearmesh\" \"point3 P\" [ 1.1 -2 0  1.1 2 0  1.1 -2 3  1.1 2 3 ]\n";
  const std::string floor = "Material \"diffuse\"\n" + plane;
  for (const char* cache : {"on", "off"}) {
    const std::vector<std::string> options{"--bounces", "1", "--radiosity-cache", cache};
    const Rendered ink =
        render_world(floor + plugin(examples + "/libtoon.so", R"("float rim" 2 "rgb ink" [ 9 0 0 ])") + wall, options);
    const Rendered grey = render_world(floor + "Material \"diffuse\"\n" + wall, options);
    ASSERT_EQ(ink.run.exit_code, 0) << ink.run.output;
    EXPECT_NEAR(ink.mean[0], grey.mean[0], 5e-3 * grey.mean[0]) << cache;
    EXPECT_NEAR(ink.mean[0], ink.mean[1], 1e-4) << cache;
  }
}

// A mirror that shows a wall of ink: in a frame of which a part is traced as paths, stages that see light still run.
TEST(Toon, IsSeenInMirrors) {
  const Rendered r = render_world(
      "Material \"conductor\" \"float roughness\" 0\n"
      "Shape \"bilinearmesh\" \"point3 P\" [ -2 -2 2  2 -2 -2  -2 2 2  2 2 -2 ]\n" +
          plugin(examples + "/libtoon.so", R"("float rim" 2 "rgb ink" [ 9 0 0 ])") +
          "Shape \"bilinearmesh\" \"point3 P\" [ 3 -2 -3  3 2 -3  3 -2 3  3 2 3 ]\n",
      {"--preset", "preview", "--bounces", "1"});
  ASSERT_EQ(r.run.exit_code, 0) << r.run.output;
  EXPECT_GT(r.mean[0], 4);
  EXPECT_LT(r.mean[1], 1e-3);
}

double fresnel(double cos_i, double n) {  // from outside; unpolarised
  const double cos_t = std::sqrt(1 - (1 - cos_i * cos_i) / (n * n));
  const double s = (cos_i - n * cos_t) / (cos_i + n * cos_t), p = (n * cos_i - cos_t) / (n * cos_i + cos_t);
  return (s * s + p * p) / 2;
}

// A film of reflectance R to diffuse light sends back p = 1 - (1 - R) / n^2 from inside (reciprocity of radiance over
// n^2), and damp stone shows R + (1 - R) (1 - p) a / (1 - p a).
TEST(WetStone, DampnessDarkens) {
  const double n = 1.33, a = 0.4;
  double R = 0;
  for (int i = 0; i < 10000; ++i) R += 2 * (i + 0.5) / 1e4 * fresnel((i + 0.5) / 1e4, n) / 1e4;
  const double p = 1 - (1 - R) / (n * n);
  const auto shown = [&](const std::string& wetness, const std::string& albedo) {
    const Rendered r =
        render_world(plugin(examples + "/libwet_stone.so", "\"float water\" 0 \"float variation\" 0 \"rgb joint\" [ " +
                                                               albedo + " ] \"rgb reflectance\" [ " + albedo +
                                                               " ] \"float wetness\" " + wetness) +
                     plane);
    EXPECT_EQ(r.run.exit_code, 0) << r.run.output;
    return r.mean[1];
  };
  EXPECT_NEAR(shown("0", ".4 .4 .4"), a, 1e-3);
  EXPECT_NEAR(shown("1", ".4 .4 .4"), R + (1 - R) * (1 - p) * a / (1 - p * a), 1e-3);
  EXPECT_NEAR(shown("1", "1 1 1"), 1, 1e-3);
}

TEST(Examples, ScenesRender) {
  for (const char* name : {"toon", "wet_stone", "lights"}) {
    ScratchFolder folder;
    std::filesystem::create_directory(folder.path() / "build");
    std::filesystem::copy_file(source_path(std::string("examples/plugins/") + name + ".pbrt"),
                               folder.path() / "scene.pbrt");
    for (const char* library : {"libtoon.so", "libwet_stone.so", "libbarn_doors.so", "libhoneycomb.so"})
      std::filesystem::copy_file(examples + "/" + library, folder.path() / "build" / library);
    const ProcessResult r =
        run_dapple({"render", folder.file("scene.pbrt"), "-o", folder.file("image.png"), "--resolution", "96x60",
                    "--shadow-rays", "4", "--diffuse-rays", "4", "--pixel-samples", "4", "--strict"},
                   120);
    EXPECT_EQ(r.exit_code, 0) << r.output;
  }
}

TEST(PluginInfo, ListsParameters) {
  const ProcessResult r = run_dapple({"plugin-info", examples + "/libtoon.so"}, 60);
  EXPECT_EQ(r.exit_code, 0);
  for (const char* part :
       {"shader         toon", "prelighting, postlighting\n", "tones", "integer", "default 4", "number of tones"})
    expect_contains(r.output, part);
  EXPECT_EQ(run_dapple({"plugin-info", source_path("README.md")}, 60).exit_code, 3);
}

TEST(PluginParameters, HaveTheirDefaultsAndUnknownOnesAreNamed) {
  EXPECT_EQ(render_world(probe(R"("string fault" "values")") + plane).run.exit_code, 0);
  const Rendered r = render_world(probe("\n \"float colour\" 3") + plane);
  EXPECT_EQ(r.run.exit_code, 0);
  expect_contains(r.run.output, "scene.pbrt:10:");
  expect_contains(r.run.output, "expected one of: filename, fault, coverage, colored, a_bool, an_integer, a_colour");
  const Rendered wrong = render_world(probe(R"("string an_integer" "seven")") + plane);
  EXPECT_EQ(wrong.run.exit_code, 3);
  expect_contains(wrong.run.output, "scene.pbrt:9:");
}

struct Broken {
  const char* name;
  const char* file;  ///< of the modules' folder
  const char* parameters;
  const char* said;
};
void PrintTo(const Broken& b, std::ostream* out) {
  *out << b.name;
}

class BrokenPlugin : public testing::TestWithParam<Broken> {};

// An error at its place; or, with --keep-going, a magenta surface: reflectance (1, 0, 1) under a sky of radiance 1.
TEST_P(BrokenPlugin, IsRefusedOrStoodInFor) {
  const std::string world = plugin(modules + "/" + GetParam().file, GetParam().parameters) + plane;
  const Rendered refused = render_world(world);
  EXPECT_EQ(refused.run.exit_code, 3) << refused.run.output;
  expect_contains(refused.run.output, "scene.pbrt:9:");
  expect_contains(refused.run.output, GetParam().said);
  EXPECT_TRUE(refused.picture.rgb.empty());
  const Rendered kept = render_world(world, {"--keep-going"});
  EXPECT_EQ(kept.run.exit_code, 0) << kept.run.output;
  expect_contains(kept.run.output, GetParam().said);
  EXPECT_NEAR(kept.mean[0], 1, 1e-3);
  EXPECT_NEAR(kept.mean[1], 0, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(
    Ways, BrokenPlugin,
    testing::Values(Broken{"missing", "libabsent.so", "", "No such file"},
                    Broken{"folder", ".", "", "it is not a file"}, Broken{"text", "text.so", "", "not a shared object"},
                    Broken{"truncated", "truncated.so", "", "cut short"},
                    Broken{"no_entry", "libno_entry.so", "", "expected DAPPLE_SHADER_PLUGIN"},
                    Broken{"version", "libother_version.so", "", "it has plug-in ABI version 9, expected 3"},
                    Broken{"layout", "libother_layout.so", "", "layout"},
                    Broken{"factory", "libprobe.so", R"("string fault" "factory")", "the factory is closed"},
                    Broken{"undeclared", "libprobe.so", R"("string fault" "undeclared")",
                           "\"nowhere\" is not declared"}),
    [](const auto& test) { return test.param.name; });

class FailingStage : public testing::TestWithParam<const char*> {};

// The half of the plane with x > 0 is shown in magenta, the other as it should be: grey of 1/2.
TEST_P(FailingStage, PaintsItsOwnPointsAndEndsInOrder) {
  const std::string stage = GetParam(), world = probe("\"string fault\" \"" + stage + "\"") + plane;
  const Rendered r = render_world(world, {"--threads", "1"});
  EXPECT_EQ(r.run.exit_code, 3) << r.run.output;
  expect_contains(r.run.output, "scene.pbrt:9:");
  expect_contains(r.run.output, "shader \"probe\" of libprobe.so");
  expect_contains(r.run.output, stage + " threw at ");
  expect_contains(r.run.output, stage + " failed");
  ASSERT_EQ(r.picture.width, 64);
  const float *grey = r.picture.at(48, 32), *painted = r.picture.at(16, 32);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(grey[c], 0.5f, 1e-3f);
  EXPECT_LT(painted[1], 1e-3f);
  EXPECT_GT(painted[0], 0.2f);
  EXPECT_EQ(render_world(world, {"--threads", "2"}).picture.rgb, r.picture.rgb);
  EXPECT_EQ(render_world(world, {"--keep-going"}).run.exit_code, 0);
}

INSTANTIATE_TEST_SUITE_P(Stages, FailingStage,
                         testing::Values("prelighting", "diffuselighting", "specularlighting", "postlighting"),
                         [](const auto& test) { return std::string(test.param); });

TEST(FailingStage, OpacityThatThrowsIsOpaque) {
  const Rendered r = render_world(probe(R"("string fault" "opacity")") + plane);
  EXPECT_EQ(r.run.exit_code, 3);
  expect_contains(r.run.output, "opacity threw at ");
  EXPECT_NEAR(r.mean[1], 0.5, 1e-3);
}

TEST(FailingStage, WhatIsThrownNeedNotBeAnException) {
  const Rendered r = render_world(probe(R"("string fault" "word")") + plane);
  EXPECT_EQ(r.run.exit_code, 3);
  expect_contains(r.run.output, "what is not a std::exception");
}

struct BadValue {
  const char* fault;
  const char* stage;
  double green;  ///< of the half that is wrong
};
void PrintTo(const BadValue& b, std::ostream* out) {
  *out << b.fault;
}
class BadValues : public testing::TestWithParam<BadValue> {};

TEST_P(BadValues, AreReplacedCountedAndNamed) {
  const std::string world = probe(std::string("\"string fault\" \"") + GetParam().fault + "\"") + plane;
  const Rendered r = render_world(world);
  EXPECT_EQ(r.run.exit_code, 0) << r.run.output;
  expect_contains(r.run.output, std::string(GetParam().stage) + " gave values that are wrong at ");
  EXPECT_NEAR(r.picture.at(48, 32)[1], 0.5, 1e-3);
  EXPECT_NEAR(r.picture.at(16, 32)[1], GetParam().green, 1e-3);
  EXPECT_EQ(render_world(world, {"--strict"}).run.exit_code, 3);
}
INSTANTIATE_TEST_SUITE_P(Faults, BadValues,
                         testing::Values(BadValue{"nan", "prelighting", 0}, BadValue{"negative", "prelighting", 0},
                                         BadValue{"frame", "prelighting", 0.5}, BadValue{"kind", "prelighting", 0},
                                         BadValue{"infinity", "postlighting", 0}),
                         [](const auto& test) { return std::string(test.param.fault); });

// Where coverage is the mean of (.1, .25, .4), and of alpha 1/2, a grey of 1/2 hides that share of a sky of 1. Or each
// channel by itself, if the shader says so.
TEST(Opacity, OfShaderAndShapeMultiply) {
  for (const char* integrator : {"path", "distribution"}) {
    const std::vector<std::string> options{"--pixel-samples", "64"};
    const std::string material = probe("\"rgb coverage\" [ .1 .25 .4 ]");
    const Rendered whole = render_world(material + plane, options, integrator);
    ASSERT_EQ(whole.run.exit_code, 0) << whole.run.output;
    EXPECT_NEAR(whole.mean[1], 1 - 0.25 * 0.5, 2e-3) << integrator;
    const Rendered half =
        render_world(material + plane.substr(0, plane.size() - 1) + " \"float alpha\" .5\n", options, integrator);
    EXPECT_NEAR(half.mean[1], 1 - 0.125 * 0.5, 2e-3) << integrator;
    const Rendered colored =
        render_world(probe("\"rgb coverage\" [ .1 .25 .4 ] \"bool colored\" true") + plane, options, integrator);
    const double coverage[] = {0.1, 0.25, 0.4};
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(colored.mean[c], 1 - coverage[c] * 0.5, 4e-3) << integrator;
  }
}

// A lamp of 8 pi W/sr, 3 above the plane, is 2 above the raised one: E = 2 pi there, to which the sky adds pi.
TEST(Displacement, MovesMeshesAlongTheirNormal) {
  const std::string lamp = "LightSource \"point\" \"float scale\" 25.132741 \"point3 from\" [ 0 0 3 ]\n";
  const Rendered r = render_world(lamp + plugin(modules + "/libraised.so", "") + plane);
  ASSERT_EQ(r.run.exit_code, 0) << r.run.output;
  EXPECT_NEAR(r.picture.at(32, 32)[1], 0.5 * (2 + 1), 0.01);
  const Rendered failed = render_world(lamp + plugin(modules + "/libraised.so", "\"bool fails\" true") + plane);
  EXPECT_EQ(failed.run.exit_code, 3);
  expect_contains(failed.run.output, "displacement threw at ");
  expect_contains(failed.run.output, "no way up");
  const Rendered ball = render_world(plugin(modules + "/libraised.so", "") + "Shape \"sphere\"\n");
  EXPECT_EQ(ball.run.exit_code, 0);
  expect_contains(ball.run.output, "displacement of shape \"sphere\" by its shader is not supported");
}

TEST(PathIntegrator, SaysWhichStagesItLeavesOut) {
  const Rendered r = render_world(plugin(examples + "/libtoon.so", "") + plane, {}, "path");
  EXPECT_EQ(r.run.exit_code, 0) << r.run.output;
  expect_contains(r.run.output, "postlighting with --integrator path");
  EXPECT_EQ(render_world(plugin(examples + "/libtoon.so", "") + plane, {"--strict"}, "path").run.exit_code, 3);
  // Gains go with such stages (tests/api), and with paths that leave them out.
  for (const char* integrator : {"distribution", "path"}) {
    const Rendered gain =
        render_world(plugin(examples + "/libtoon.so", "") + plane, {"--gain", "default=2"}, integrator);
    EXPECT_EQ(gain.run.exit_code, 0) << gain.run.output;
  }
}

TEST(Mix, RunsThePrelightingOfPlugins) {
  const Rendered r = render_world(
      "MakeNamedMaterial \"a\" \"string type\" \"plugin\" \"string filename\" \"" + modules + "/libprobe.so\"\n" +
      "MakeNamedMaterial \"b\" \"string type\" \"diffuse\" \"rgb reflectance\" [ .5 .5 .5 ]\n" +
      "Material \"mix\" \"string materials\" [ \"a\" \"b\" ]\n" + plane);
  EXPECT_EQ(r.run.exit_code, 0) << r.run.output;
  expect_contains(r.run.output, "a mix of shaders that have other stages");
  EXPECT_NEAR(r.mean[1], 0.5, 1e-3);
}

}  // namespace
}  // namespace dapple::test
