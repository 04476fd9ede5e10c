// SPDX-License-Identifier: Apache-2.0
// The command line as promised in DESIGN section 5: exit codes.
#include <gtest/gtest.h>

#include <fstream>

#include "tests/cli/quick_render.h"
#include "tests/support/exr_layers.h"

namespace dapple::test {
namespace {

TEST(ExitCode, HelpAndVersionAreNoErrors) {
  EXPECT_EQ(run_dapple({"--help"}, 60).exit_code, 0);
  EXPECT_EQ(run_dapple({"--version"}, 60).exit_code, 0);
  const ProcessResult help = run_dapple({"render", "--help"}, 60);
  EXPECT_EQ(help.exit_code, 0);
  for (const char* option : {"--bounces", "--pixel-samples", "--threads", "--seed", "--stats", "--crop", "--aov"})
    EXPECT_NE(help.output.find(option), std::string::npos) << option;
}

TEST(ExitCode, WrongUseIs2) {
  EXPECT_EQ(run_dapple({}, 60).exit_code, 2);
  const ProcessResult paint = run_dapple({"paint"}, 60);
  EXPECT_EQ(paint.exit_code, 2);
  EXPECT_NE(paint.output.find("unknown command \"paint\"; expected one of: render, "), std::string::npos)
      << paint.output;
  const ProcessResult plant = run_dapple({"trees", "plant"}, 60);
  EXPECT_EQ(plant.exit_code, 2);
  EXPECT_NE(plant.output.find("unknown command \"plant\" of dapple trees; expected one of: "), std::string::npos)
      << plant.output;
  EXPECT_EQ(run_dapple({"render"}, 60).exit_code, 2);
  EXPECT_EQ(run_dapple({"render", cornell, "--no-such-option"}, 60).exit_code, 2);
  EXPECT_EQ(run_dapple({"render", cornell, "--pixel-samples", "-1"}, 60).exit_code, 2);
  EXPECT_EQ(run_dapple({"render", cornell, "--resolution", "16"}, 60).exit_code, 2);
  EXPECT_EQ(run_dapple({"render", cornell, "--opacity-cache", "perhaps"}, 60).exit_code, 2);
  EXPECT_EQ(render_quickly({cornell, "-o", "unused.exr", "--light-groups", "--integrator", "ao"}).exit_code, 2);
  for (const char* option : {"--shading-rate", "--cache-mb", "--cache-width", "--irradiance-accuracy", "--max-distance",
                             "--pixel-noise", "--time-limit", "--noise-target"})
    EXPECT_EQ(render_quickly({cornell, "-o", "unused.exr", option, "nan"}).exit_code, 2) << option;
}

TEST(ExitCode, GainsOfLightGroups) {
  EXPECT_NE(run_dapple({"render", cornell, "--gain", "key:2"}, 60).output.find("--gain: \"key:2\"; expected GROUP="),
            std::string::npos);
  ScratchFolder folder;
  const auto render = [&](const std::string& name, std::vector<std::string> options) {
    options.insert(options.begin(), {cornell, "-o", folder.file(name), "--float", "--integrator", "path"});
    return render_quickly(options);
  };
  ASSERT_EQ(render("plain.exr", {}).exit_code, 0);
  const ProcessResult mixed = render("mixed.exr", {"--gain", "default=2,1,.25"});
  ASSERT_EQ(mixed.exit_code, 0) << mixed.output;
  const ExrLayers plain(folder.file("plain.exr")), twice(folder.file("mixed.exr"));
  const std::pair<const char*, float> gains[] = {{"R", 2}, {"G", 1}, {"B", .25f}};
  for (const auto& [channel, gain] : gains)
    for (size_t i = 0; i < plain[channel].size(); ++i)
      ASSERT_NEAR(twice[channel][i], gain * plain[channel][i], 1e-5f * (1 + plain[channel][i]));
  for (const char* wrong :
       {"default", "default=", "default=x", "default=-1", "default=1,2", "kay=2", "=2", "default=1e30"})
    EXPECT_EQ(render("wrong.exr", {"--gain", wrong}).exit_code, 2) << wrong;
  EXPECT_NE(render("wrong.exr", {"--gain", "kay=2"}).output.find("no light is of the group \"kay\""),
            std::string::npos);
  const ProcessResult noise = render("wrong.exr", {"--gain", "default=2", "--noise-target", ".1"});
  EXPECT_EQ(noise.exit_code, 2);
  EXPECT_NE(noise.output.find("a noise target is judged by samples"), std::string::npos) << noise.output;
}

TEST(ExitCode, SeedsAreWhole) {
  ScratchFolder folder;
  const auto render = [&](const char* seed) {
    return render_quickly({cornell, "-o", folder.file("seed.exr"), "--seed", seed});
  };
  EXPECT_EQ(render("18446744073709551615").exit_code, 0);
  for (const char* wrong : {"-1", "18446744073709551616", "1.5", "x"}) {
    const ProcessResult refused = render(wrong);
    EXPECT_EQ(refused.exit_code, 2) << wrong;
    EXPECT_NE(refused.output.find("must be a whole number from 0 to 18446744073709551615"), std::string::npos)
        << refused.output;
  }
}

// Rationale: limits of the number format are no help.
TEST(ExitCode, NumbersOutOfRangeAreShortlyNamed) {
  const auto check = [](const std::string& option, const std::string& value, const std::string& expected) {
    const ProcessResult result = run_dapple({"render", cornell, "-o", "unused.exr", option, value}, 60);
    EXPECT_EQ(result.exit_code, 2) << result.output;
    EXPECT_NE(result.output.find(option + ": must be " + expected + ", not " + value), std::string::npos)
        << result.output;
  };
  for (const char* option : {"--pixel-samples", "--max-distance", "--pixel-noise", "--time-limit", "--noise-target"})
    for (const char* bad : {"0", "-1", "many"}) check(option, bad, "above 0");
  for (const char* option : {"--bounces", "--specular-depth"}) check(option, "-1", "0 or more");
}

// Rationale: whoever keeps what is printed must know that it was lost.
TEST(ExitCode, FullStandardOutputIs4) {
  ScratchFolder folder;
  const std::string canopy = folder.file("canopy.json");
  std::ofstream(canopy)
      << R"({"layers": [{"bottom_m": 0, "top_m": 1, "leaf_area_index": 1, "reflectance": 0.1, "transmittance": 0.1}],
    "ground": {"reflectance": 0.1}, "sky": {"type": "uniform", "irradiance_W_m2": 1}})";
  const auto check = [](std::vector<std::string> arguments, int code) {
    arguments.insert(arguments.begin(), {"/bin/sh", "-c", "exec \"$0\" \"$@\" > /dev/full", DAPPLE_BINARY});
    const ProcessResult result = run_process(arguments, 60);
    EXPECT_EQ(result.exit_code, code) << result.output;
    EXPECT_EQ(result.output.find("cannot write to standard output") != std::string::npos, code == 4) << result.output;
  };
  check({"canopy", "solve", canopy}, 4);
  check({"info", cornell}, 4);
  check({"--help"}, 4);
  check({"--version"}, 4);
  check({"info", "/no/such/scene.pbrt"}, 3);  // nothing was printed
}

TEST(ExitCode, UnknownCompressionIs2BeforeAnyWork) {
  const ProcessResult result =
      run_dapple({"render", "no-such-scene.pbrt", "-o", "unused.exr", "--compression", "zap"}, 60);
  EXPECT_EQ(result.exit_code, 2) << result.output;
  EXPECT_NE(result.output.find("unknown compression \"zap\", expected one of: none"), std::string::npos)
      << result.output;
}

TEST(ExitCode, ViewsWithoutAConfigurationAre2BeforeAnyWork) {
  ScratchFolder folder;
  const std::vector<std::string> render{"render", cornell, "-o", folder.file("a.png"), "--pixel-samples", "1000000"};
  const auto check = [&](const std::vector<std::string>& options, const std::string& words) {
    std::vector<std::string> all{"/usr/bin/env", "-u", "OCIO", DAPPLE_BINARY};
    all.insert(all.end(), render.begin(), render.end());
    all.insert(all.end(), options.begin(), options.end());
    const ProcessResult result = run_process(all, 60);
    EXPECT_EQ(result.exit_code, 2) << result.output;
    EXPECT_NE(result.output.find(words), std::string::npos) << result.output;
  };
  check({"--view", "ACES"}, "expected one given by --ocio or $OCIO");
  check({"--display", "monitor"}, "without a view");
}

// Expectation: numbers that no integer holds are as wrong as words.
TEST(ExitCode, BadResolutionAndCropAre2) {
  const auto check = [](const std::string& option, const std::string& text, const std::string& expected) {
    const ProcessResult result = run_dapple({"render", cornell, "-o", "unused.exr", option, text}, 60);
    EXPECT_EQ(result.exit_code, 2) << result.output;
    EXPECT_NE(result.output.find(option + ": \"" + text + "\"; expected " + expected), std::string::npos)
        << result.output;
  };
  for (const char* bad : {"16", "16x", "x16", "16x16x16", "16,16", "0x16", "16x-1", "1.5x16", "0x10x16",
                          "4294967312x16", "16x99999999999999999999"})
    check("--resolution", bad, "WIDTHxHEIGHT, such as 960x540");
  for (const char* bad : {"0,0,8", "0,0,8,8,8", "0,0,8,", "0,0,8,x", "0,0,4294967304,8", "0,0,8,99999999999999999999"})
    check("--crop", bad, "X0,Y0,X1,Y1 in pixels");
}

TEST(ExitCode, UnknownVisiblePointsAreNamed) {
  EXPECT_EQ(render_quickly({cornell, "-o", "unused.exr", "--visible-points", "dots"}).exit_code, 2);
  ScratchFolder folder;
  const std::string scene = folder.file("dots.pbrt");
  std::ofstream(scene) << "Integrator \"distribution\" \"string visiblepoints\" \"dots\"\nWorldBegin\n";
  const ProcessResult result = render_quickly({scene, "-o", "unused.exr"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_NE(result.output.find("\"visiblepoints\" is \"dots\""), std::string::npos) << result.output;
}

// Rationale: how far noisy blocks may go is a number of samples from that of all pixels on.
TEST(ExitCode, BadMaxPixelSamplesAre2) {
  const auto check = [](const std::vector<std::string>& options, const std::string& named) {
    std::vector<std::string> all{"render", cornell, "-o", "unused.exr", "--resolution", "16x16"};
    all.insert(all.end(), options.begin(), options.end());
    const ProcessResult result = run_dapple(all, 60);
    EXPECT_EQ(result.exit_code, 2) << result.output;
    EXPECT_NE(result.output.find(named), std::string::npos) << result.output;
  };
  check({"--pixel-samples", "8", "--max-pixel-samples", "7"}, "below the 8 camera samples");
  check({"--preset", "final", "--max-pixel-samples", "8"}, "camera samples");
  check({"--time-limit", "1", "--max-pixel-samples", "64"}, "--pixel-samples");
  check({"--noise-target", ".1", "--max-pixel-samples", "64"}, "--pixel-samples");
  for (const char* bad : {"0", "-1", "1e9", "many"}) check({"--max-pixel-samples", bad}, "--max-pixel-samples");
  for (const char* bad : {"0", "-1", "nan"}) check({"--pixel-noise", bad}, "--pixel-noise");
  check({"--pixel-samples", "8", "--pixel-noise", ".05"}, "--max-pixel-samples");
}

TEST(ExitCode, BadMaxPixelSamplesOfSceneAre3) {
  ScratchFolder folder;
  const std::string scene = folder.file("samples.pbrt");
  for (const char* bad : {"\"integer maxpixelsamples\" 0", "\"integer maxpixelsamples\" 2147483647",
                          "\"float pixelnoise\" 0", "\"float pixelnoise\" -1"}) {
    std::ofstream(scene) << "Integrator \"distribution\" " << bad << "\nWorldBegin\n";
    const ProcessResult result = render_quickly({scene, "-o", folder.file("out.exr")});
    EXPECT_EQ(result.exit_code, 3) << bad << result.output;
    EXPECT_NE(result.output.find("samples.pbrt:1"), std::string::npos) << result.output;
  }
}

TEST(ExitCode, MissingSceneIs3) {
  const ProcessResult result = run_dapple({"render", "/no/such/scene.pbrt"}, 60);
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_NE(result.output.find("/no/such/scene.pbrt"), std::string::npos) << result.output;
}

// Rationale: an integrator that the command line chose is not to be blamed on a line of the scene.
TEST(ExitCode, CanopiesThatAreNoneAre3) {
  ScratchFolder folder;
  const std::string scene = folder.file("bare.pbrt");
  for (const char* integrator : {"canopy", "path"}) {
    std::ofstream(scene) << "Camera \"perspective\"\nIntegrator \"" << integrator
                         << "\"\nWorldBegin\nLightSource \"infinite\"\n";
    const bool chosen = integrator == std::string("path");
    const ProcessResult result =
        render_quickly(chosen ? std::vector<std::string>{scene, "-o", folder.file("a.exr"), "--integrator", "canopy"}
                              : std::vector<std::string>{scene, "-o", folder.file("a.exr")});
    EXPECT_EQ(result.exit_code, 3) << result.output;
    EXPECT_NE(result.output.find(chosen ? "bare.pbrt with --integrator canopy:" : "bare.pbrt:2:1:"), std::string::npos)
        << result.output;
  }
}

// Rationale: what masks cannot be made of is bad input, which names the option and what is legal.
TEST(ExitCode, BadLightShaftsAre3) {
  const auto check = [](const std::vector<std::string>& options, const std::string& named, const std::string& legal) {
    std::vector<std::string> all{cornell, "-o", "unused.exr"};
    all.insert(all.end(), options.begin(), options.end());
    const ProcessResult result = render_quickly(all);
    EXPECT_EQ(result.exit_code, 3) << result.output;
    EXPECT_NE(result.output.find(named), std::string::npos) << result.output;
    EXPECT_NE(result.output.find(legal), std::string::npos) << result.output;
  };
  check({"--light-shafts", "painted"}, "--light-shafts", "rays, scan-planes");
  check({"--shaft-scattering", "double"}, "--shaft-scattering", "all, single");
  for (const char* bad : {"0", "15", "-3"}) check({"--shaft-planes", bad}, "--shaft-planes", "16 to");
  for (const char* bad : {"0", "15", "100000"}) check({"--shaft-bins", bad}, "--shaft-bins", "16 to 65536");
  for (const char* bad : {"0", "-1", "nan"}) check({"--shaft-mb", bad}, "--shaft-mb", "MB above 0");

  ScratchFolder folder;
  const std::string scene = (folder.path() / "shafts.pbrt").string();
  std::ofstream(scene) << "Integrator \"path\" \"string lightshafts\" \"planes\"\nWorldBegin\n";
  const ProcessResult result = render_quickly({scene, "-o", (folder.path() / "out.exr").string()});
  EXPECT_EQ(result.exit_code, 3) << result.output;
  EXPECT_NE(result.output.find("shafts.pbrt:1"), std::string::npos) << result.output;
  EXPECT_NE(result.output.find("lightshafts"), std::string::npos) << result.output;

  // Where they do not apply: rays, and one warning; without being asked for, none.
  const ProcessResult without =
      render_quickly({cornell, "-o", (folder.path() / "out.exr").string(), "--light-shafts", "scan-planes"});
  EXPECT_EQ(without.exit_code, 0) << without.output;
  EXPECT_NE(without.output.find("no medium"), std::string::npos) << without.output;
  EXPECT_EQ(render_quickly({cornell, "-o", (folder.path() / "out.exr").string()}).output.find("shafts"),
            std::string::npos);
}

TEST(ExitCode, BadLevelOfDetailIs2) {
  for (const char* bad : {"on", "0", "-1", "65", "nan", "1px"}) {
    for (const ProcessResult& result : {render_quickly({cornell, "-o", "unused.exr", "--lod", bad}),
                                        run_dapple({"info", "no_such_scene.pbrt", "--lod", bad}, 60)}) {
      EXPECT_EQ(result.exit_code, 2) << result.output;
      EXPECT_NE(result.output.find("--lod"), std::string::npos) << result.output;
      EXPECT_NE(result.output.find("\"auto\" or pixels"), std::string::npos) << result.output;
    }
  }
  EXPECT_EQ(render_quickly({cornell, "-o", "unused.exr", "--lod", ""}).exit_code, 2);
  EXPECT_EQ(render_quickly({cornell, "-o", "unused.exr", "--lod", "1", "--next", cornell}).exit_code, 2);
}

TEST(ExitCode, BadShadowMasksAre3) {
  const auto check = [](const std::vector<std::string>& options, const std::string& named, const std::string& legal) {
    std::vector<std::string> all{cornell, "-o", "unused.exr"};
    all.insert(all.end(), options.begin(), options.end());
    const ProcessResult result = render_quickly(all);
    EXPECT_EQ(result.exit_code, 3) << result.output;
    EXPECT_NE(result.output.find(named), std::string::npos) << result.output;
    EXPECT_NE(result.output.find(legal), std::string::npos) << result.output;
  };
  check({"--sun-shadows", "painted"}, "--sun-shadows", "rays, masks");
  for (const char* bad : {"0", "-5", "7", "4097"}) check({"--mask-levels", bad}, "--mask-levels", "8 to 4096");
  for (const char* bad : {"0", "-1", "nan", "inf"}) check({"--mask-pixel", bad}, "--mask-pixel", "above 0");
  for (const char* bad : {"-1", "1025"}) check({"--mask-sky", bad}, "--mask-sky", "0 to 1024");
  for (const char* bad : {"0", "-1", "nan"}) check({"--mask-mb", bad}, "--mask-mb", "MB above 0");
  for (const char* bad : {"-1", "nan", "inf"}) check({"--far-ground", bad}, "--far-ground", "0 or more");
  for (const char* bad : {"-1", "nan"})
    check({"--far-ground", "5", "--ground-pixel", bad}, "--ground-pixel", "0 or more");

  ScratchFolder folder;
  const std::string scene = (folder.path() / "masks.pbrt").string();
  std::ofstream(scene)
      << "Integrator \"distribution\" \"string sunshadows\" \"masks\" \"integer masklevels\" 3\nWorldBegin\n";
  const ProcessResult result = render_quickly({scene, "-o", (folder.path() / "out.exr").string()});
  EXPECT_EQ(result.exit_code, 3) << result.output;
  EXPECT_NE(result.output.find("masks.pbrt:1"), std::string::npos) << result.output;
  EXPECT_NE(result.output.find("masklevels"), std::string::npos) << result.output;

  // No sun: said once, and rays as ever. A pixel far too small for a sun's disc: refused.
  const ProcessResult without =
      render_quickly({cornell, "-o", (folder.path() / "out.exr").string(), "--sun-shadows", "masks"});
  EXPECT_EQ(without.exit_code, 0) << without.output;
  EXPECT_NE(without.output.find("no sun"), std::string::npos) << without.output;
  const std::string sunny = (folder.path() / "sunny.pbrt").string();
  std::ofstream(sunny) << "LookAt 0 0 5  0 0 0  0 1 0 Camera \"perspective\"\nWorldBegin\nLightSource \"sky\" \"float "
                          "sunirradiance\" 1\n"
                          "Shape \"sphere\"\n";
  const ProcessResult small = render_quickly(
      {sunny, "-o", (folder.path() / "out.exr").string(), "--sun-shadows", "masks", "--mask-pixel", "1e-6"});
  EXPECT_EQ(small.exit_code, 3) << small.output;
  EXPECT_NE(small.output.find("too wide"), std::string::npos) << small.output;
}

TEST(ExitCode, UnwritableOutputIs4BeforeAnyWork) {
  const ProcessResult result =
      run_dapple({"render", cornell, "-o", "/no/such/folder/image.exr", "--pixel-samples", "1000000"}, 20);
  EXPECT_EQ(result.exit_code, 4) << result.output;
  EXPECT_NE(result.output.find("/no/such/folder"), std::string::npos) << result.output;
}

TEST(ExitCode, PatternsAboveTheirBoundAreNamed) {
  ScratchFolder folder;
  const std::string scene = folder.file("fog.pbrt");
  std::ofstream(scene) << R"(Camera "perspective"
WorldBegin
LightSource "infinite"
Texture "x" "float" "coordinate" "string which" "x"
MakeNamedMedium "fog" "string type" "pattern" "point3 p0" [ -5 -5 0 ] "point3 p1" [ 5 5 9 ] "texture density" "x" "float maxdensity" 1
AttributeBegin
  Material "interface"
  MediumInterface "fog" ""
  Translate 0 0 4
  Shape "sphere" "float radius" 3
AttributeEnd
)";
  for (const char* integrator : {"path", "distribution"}) {
    const ProcessResult result = render_quickly({scene, "-o", folder.file("fog.png"), "--integrator", integrator});
    EXPECT_EQ(result.exit_code, 0) << result.output;
    EXPECT_NE(result.output.find("fog.pbrt:5:1: medium \"fog\": \"density\" was above its bound of 1 at "),
              std::string::npos)
        << result.output;
    EXPECT_NE(result.output.find("\"density\" was negative or not finite at "), std::string::npos) << result.output;
    EXPECT_EQ(render_quickly({scene, "-o", folder.file("fog.png"), "--integrator", integrator, "--strict"}).exit_code,
              3);
  }
}

}  // namespace
}  // namespace dapple::test
