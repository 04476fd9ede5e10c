// SPDX-License-Identifier: Apache-2.0
// `dapple render`: outputs, layers, headers, statistics; `dapple info`.
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>

#include "tests/cli/quick_render.h"
#include "tests/support/exr_layers.h"

namespace dapple::test {
namespace {

TEST(Render, WritesExrAndPngOfOneRendering) {
  ScratchFolder folder;
  const ProcessResult result =
      render_quickly({cornell, "-o", folder.file("image.exr"), "-o", folder.file("image.png")});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  for (const char* name : {"image.exr", "image.png"}) {
    const Picture p = load_picture(folder.file(name));
    EXPECT_EQ(p.width, 16) << name;
    EXPECT_EQ(p.height, 16) << name;
  }
}

TEST(Render, PngIsTheExrInSrgb) {
  ScratchFolder folder;
  ASSERT_EQ(render_quickly({cornell, "-o", folder.file("a.exr"), "--float"}).exit_code, 0);
  ASSERT_EQ(render_quickly({cornell, "-o", folder.file("a.png")}).exit_code, 0);
  const Picture linear = load_picture(folder.file("a.exr")), display = load_picture(folder.file("a.png"));
  for (size_t i = 0; i < linear.rgb.size(); ++i) {
    const float v = std::clamp(linear.rgb[i], 0.0f, 1.0f);
    const float srgb = v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1 / 2.4f) - 0.055f;
    EXPECT_NEAR(display.rgb[i], srgb, 1.01f / 255) << i;
  }
}

TEST(Render, CropsEndAtTheImage) {
  ScratchFolder folder;
  for (const char* crop : {"-5,-5,10,8", "0,0,10,8"}) {
    const ProcessResult result = render_quickly({cornell, "-o", folder.file("a.png"), "--crop=" + std::string(crop)});
    ASSERT_EQ(result.exit_code, 0) << result.output;
    const Picture p = load_picture(folder.file("a.png"));
    EXPECT_EQ(p.width, 10) << crop;
    EXPECT_EQ(p.height, 8) << crop;
  }
  for (const char* crop : {"-5,-5,0,8", "16,0,20,8", "5,5,4,8"})
    EXPECT_EQ(render_quickly({cornell, "-o", folder.file("b.png"), "--crop=" + std::string(crop)}).exit_code, 2)
        << crop;
}

// Rationale: an option that does nothing is a mistake of somebody.
TEST(Render, NamesOptionsWithoutEffect) {
  ScratchFolder folder;
  const auto warns = [&](const std::string& image, const std::vector<std::string>& options, const std::string& words) {
    std::vector<std::string> all{cornell, "-o", folder.file(image)};
    all.insert(all.end(), options.begin(), options.end());
    const ProcessResult result = render_quickly(all);
    EXPECT_EQ(result.exit_code, 0) << result.output;
    return result.output.find(options[0] + " has no effect without " + words) != std::string::npos;
  };
  for (const char* option : {"--mask-levels", "--mask-pixel", "--mask-sky", "--mask-mb"}) {
    EXPECT_TRUE(warns("a.exr", {option, "16"}, "--sun-shadows masks")) << option;
    EXPECT_FALSE(warns("a.exr", {option, "16", "--sun-shadows", "masks"}, "")) << option;
  }
  const ProcessResult ao =
      render_quickly({cornell, "-o", folder.file("a.exr"), "--integrator", "ao", "--mask-levels", "16"});
  EXPECT_NE(ao.output.find("--mask-levels has no effect with --integrator ao"), std::string::npos) << ao.output;
  for (const char* integrator : {"path", "distribution"}) {
    const ProcessResult room =
        render_quickly({cornell, "-o", folder.file("a.exr"), "--integrator", integrator, "--canopy-answers", "on"});
    EXPECT_NE(room.output.find("canopy answers: lights stand in the scene"), std::string::npos) << room.output;
  }
  const ProcessResult ended =
      render_quickly({cornell, "-o", folder.file("a.exr"), "--integrator", "ao", "--canopy-answers", "on"});
  EXPECT_NE(ended.output.find("--canopy-answers has no effect"), std::string::npos) << ended.output;
  EXPECT_EQ(render_quickly({cornell, "-o", folder.file("a.exr"), "--canopy-answers", "some"}).exit_code, 2);
  EXPECT_TRUE(warns("a.exr", {"--ground-pixel", "1"}, "--far-ground"));
  EXPECT_FALSE(warns("a.exr", {"--ground-pixel", "1", "--far-ground", "5"}, ""));
  for (const std::vector<std::string>& option : std::vector<std::vector<std::string>>{{"--aov", "depth"},
                                                                                      {"--light-groups"},
                                                                                      {"--half"},
                                                                                      {"--float"},
                                                                                      {"--tiled"},
                                                                                      {"--multi-part"},
                                                                                      {"--compression", "zip"}}) {
    EXPECT_TRUE(warns("a.png", option, "an output of type .exr")) << option[0];
    EXPECT_FALSE(warns("a.exr", option, "")) << option[0];
  }
  for (const char* option : {"--view", "--display", "--ocio"})
    EXPECT_TRUE(warns("a.exr", {option, "x"}, "an output of type .png")) << option;
  EXPECT_TRUE(warns("a.exr", {"--png-bits", "16"}, "an output of type .png"));
  EXPECT_FALSE(warns("a.png", {"--png-bits", "16"}, ""));
}

TEST(Render, WritesOnlyWhereItIsTold) {
  ScratchFolder folder;
  ASSERT_EQ(render_quickly({cornell, "-o", folder.file("a.exr")}, folder.path().string()).exit_code, 0);
  size_t files = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.path())) ++files;
  EXPECT_EQ(files, 1u);
}

TEST(Render, ReportsStatistics) {
  ScratchFolder folder;
  ASSERT_EQ(render_quickly({cornell, "-o", folder.file("a.exr"), "--stats", folder.file("s.json")}).exit_code, 0);
  const auto stats = nlohmann::json::parse(std::ifstream(folder.file("s.json")));
  for (const char* key : {"wall_seconds", "render_seconds", "render_cpu_seconds", "cpu_seconds", "peak_rss_bytes"})
    EXPECT_GT(stats.at(key).get<double>(), 0) << key;
  EXPECT_EQ(stats.at("rays").at("camera"), 16 * 16);
  for (const char* kind : {"shadow", "diffuse", "specular", "subsurface"})
    EXPECT_GE(stats.at("rays").at(kind).get<int64_t>(), 0) << kind;
  EXPECT_GE(stats.at("wall_seconds").get<double>(), stats.at("render_seconds").get<double>());
  EXPECT_GE(stats.at("cpu_seconds").get<double>(), stats.at("render_cpu_seconds").get<double>());
}

TEST(Render, TellsWhatTheAirDoes) {
  ScratchFolder folder;
  const std::string scene = folder.file("fog.pbrt");
  std::ofstream(scene) << R"(MakeNamedMedium "fog" "string type" "homogeneous" MediumInterface "" "fog"
Camera "perspective" Film "rgb" "integer xresolution" 8 "integer yresolution" 8
WorldBegin
LightSource "point" "point3 from" [ 1 1 1 ]
Shape "sphere" "float radius" .5
)";
  for (const char* integrator : {"path", "distribution"}) {
    const auto run =
        render_quickly({scene, "-o", folder.file("a.exr"), "--stats", folder.file("s.json"), "--aov",
                        "transmittance,airlight", "--integrator", integrator, "--light-shafts", "scan-planes"});
    ASSERT_EQ(run.exit_code, 0) << run.output;
    EXPECT_EQ(run.output.find("airlight is black"), std::string::npos) << run.output;
    const auto in = OIIO::ImageInput::open(folder.file("a.exr"));
    ASSERT_TRUE(in);
    for (const char* channel : {"airlight.R", "airlight.B", "transmittance.G"})
      EXPECT_GE(in->spec().channelindex(channel), 0) << channel;
    const auto stats = nlohmann::json::parse(std::ifstream(folder.file("s.json")));
    for (const char* key : {"lights", "planes", "bins", "bytes", "capacity_bytes", "fill_seconds", "queries"})
      EXPECT_GT(stats.at("shafts").at(key).get<double>(), 0) << key;
    EXPECT_GT(stats.at("rays").at("shaft").get<int64_t>(), 0);
  }
  const auto rays = render_quickly({scene, "-o", folder.file("a.exr"), "--aov", "airlight", "--light-shafts", "rays"});
  EXPECT_EQ(rays.exit_code, 0);
  EXPECT_NE(rays.output.find("airlight is black"), std::string::npos) << rays.output;
}

TEST(Render, HeaderNamesVersionSceneAndCommand) {
  ScratchFolder folder;
  ASSERT_EQ(render_quickly({cornell, "-o", folder.file("a.exr")}).exit_code, 0);
  const auto in = OIIO::ImageInput::open(folder.file("a.exr"));
  ASSERT_TRUE(in);
  const auto attribute = [&](const char* name) { return std::string(in->spec().get_string_attribute(name)); };
  EXPECT_EQ(attribute("Software").find("Dapple "), 0u) << attribute("Software");
  EXPECT_NE(attribute("dapple/commandLine").find("--pixel-samples 1"), std::string::npos);
  EXPECT_EQ(attribute("dapple/sceneFingerprint").size(), 16u);
  for (const char* matrix : {"worldToCamera", "worldToNDC"}) {
    const OIIO::ParamValue* m = in->spec().find_attribute(matrix);
    ASSERT_TRUE(m) << matrix;
    EXPECT_EQ(m->type(), OIIO::TypeMatrix) << matrix;
  }
}

TEST(Render, FingerprintTellsScenesApart) {
  ScratchFolder folder;
  const auto fingerprint = [&](const std::string& scene) {
    const std::string stats = folder.file("s.json");
    EXPECT_EQ(render_quickly({scene, "-o", folder.file("a.exr"), "--stats", stats}).exit_code, 0);
    return nlohmann::json::parse(std::ifstream(stats)).at("scene_fingerprint").get<std::string>();
  };
  EXPECT_EQ(fingerprint(cornell), fingerprint(cornell));
  EXPECT_NE(fingerprint(cornell), fingerprint(source_path("tests/cli/bad/crlf_bom.pbrt")));
}

TEST(Render, WritesTheLayersAskedFor) {
  ScratchFolder folder;
  ASSERT_EQ(render_quickly({cornell, "-o", folder.file("a.exr"), "--aov", "albedo,normal,depth"}).exit_code, 0);
  const auto in = OIIO::ImageInput::open(folder.file("a.exr"));
  ASSERT_TRUE(in);
  for (const char* channel : {"R", "G", "B", "albedo.R", "normal.X", "Z"})
    EXPECT_GE(in->spec().channelindex(channel), 0) << channel;
}

// Rationale: what is asked of a cache that does not exist is wrong use; pictures of it come with their numbers.
TEST(Render, ShowsTheRadiosityCache) {
  ScratchFolder folder;
  const std::string out = folder.file("a.exr");
  const std::vector<std::string> cached{
      "--integrator", "distribution", "--bounces", "1", "--diffuse-rays", "2", "--shadow-rays", "1"};
  const auto run = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {cornell, "-o", out});
    options.insert(options.end(), cached.begin() + 2, cached.end());
    return render_quickly(options).exit_code;
  };
  EXPECT_EQ(run({"--show-cache", "level", "--integrator", "path"}), 2);
  EXPECT_EQ(run({"--show-cache", "level", "--integrator", "distribution", "--radiosity-cache", "off"}), 2);
  EXPECT_EQ(run({"--aov", "cache_reuse", "--integrator", "path"}), 2);
  EXPECT_NE(run({"--show-cache", "size", "--integrator", "distribution"}), 0);
  EXPECT_FALSE(std::filesystem::exists(out));
  for (const char* view : {"level", "age", "fills", "reuse"}) {
    ASSERT_EQ(run({"--show-cache", view, "--integrator", "distribution"}), 0) << view;
    const auto in = OIIO::ImageInput::open(out);
    ASSERT_TRUE(in);
    for (const char* channel :
         {"R", "cache_level.coarse", "cache_level.shaded", "cache_age", "cache_fills", "cache_reuse"})
      EXPECT_GE(in->spec().channelindex(channel), 0) << channel;
  }
}

TEST(Render, MissingTextureIsAStandInWithKeepGoing) {
  ScratchFolder folder;
  const std::string scene = source_path("tests/cli/bad/texture_missing.pbrt");
  EXPECT_EQ(render_quickly({scene, "-o", folder.file("a.exr")}).exit_code, 3);
  const ProcessResult result = render_quickly({scene, "-o", folder.file("b.exr"), "--keep-going"});
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_NE(result.output.find("none.png"), std::string::npos) << result.output;
  EXPECT_FALSE(std::filesystem::exists(folder.file("a.exr")));
  EXPECT_TRUE(std::filesystem::exists(folder.file("b.exr")));
}

TEST(Render, StrictMakesWarningsErrors) {
  ScratchFolder folder;
  const std::string scene = source_path("tests/cli/bad/unknown_parameter.pbrt");
  EXPECT_EQ(render_quickly({scene, "-o", folder.file("a.exr")}).exit_code, 0);
  EXPECT_EQ(render_quickly({scene, "-o", folder.file("a.exr"), "--strict"}).exit_code, 3);
}

TEST(Info, ListsWhatIsInAScene) {
  const ProcessResult result = run_dapple({"info", cornell}, 60);
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_TRUE(std::regex_search(result.output, std::regex("\\b38 triangles"))) << result.output;
}

}  // namespace
}  // namespace dapple::test
