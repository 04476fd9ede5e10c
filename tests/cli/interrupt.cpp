// SPDX-License-Identifier: Apache-2.0
// DESIGN promise 5: an interrupt leaves the finished part of the image, whole, and exit code 130.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <thread>

#include "tests/support/dapple_program.h"

namespace dapple::test {
namespace {

class Interrupt : public testing::TestWithParam<int> {};

TEST_P(Interrupt, WritesThePartialImage) {
  ScratchFolder folder;
  const std::string image = folder.file("image.exr");
  Process process({DAPPLE_BINARY, "render", source_path("scenes/cornell-box/cornell.pbrt"), "-o", image, "--resolution",
                   "64x64", "--pixel-samples", "1000000"});
  ASSERT_TRUE(process.wait_until_it_answers(GetParam(), 60));
  std::this_thread::sleep_for(std::chrono::seconds(sanitized() ? 15 : 2));
  EXPECT_FALSE(std::filesystem::exists(image)) << "written before it was whole";
  process.send(GetParam());
  const ProcessResult result = process.wait(60);
  EXPECT_EQ(result.exit_code, 130) << result.output;
  EXPECT_NE(result.output.find("interrupted: finishing what is under way; once more stops at once\n"),
            std::string::npos)
      << result.output;

  // Light of any number of bounces, as far as it came: near the reference's mean, and finite.
  const Picture p = load_picture(image);
  const Picture reference = shrink(load_picture(source_path("tests/reference/images/cornell-b64.exr")), 4);
  Mask mask(p.width, p.height);
  mask.leave_out_brightest(reference, 0.02);
  mask.dilate(1);
  const Comparison c = compare(p, reference, mask, 16);
  EXPECT_LT(c.max_mean_error(), 0.1) << c.to_text();

  size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) files += entry.is_regular_file();
  EXPECT_EQ(files, 1u) << "temporary files were left behind";
}

// Rationale: what is there of an image of which no pass is finished is less than an older image, and that is no secret.
TEST(InterruptedFirstPass, KeepsTheOlderImage) {
  ScratchFolder folder;
  const std::string image = folder.file("image.exr"), partial = folder.file("image.partial.exr");
  const auto run = [&](const std::vector<std::string>& options) {
    std::vector<std::string> all{DAPPLE_BINARY,  "render", source_path("scenes/cornell-box/cornell.pbrt"), "-o", image,
                                 "--resolution", "512x512"};
    all.insert(all.end(), {"--threads", "1", "--integrator", "distribution", "--bounces", "1", "--diffuse-rays", "64",
                           "--shadow-rays", "4", "--radiosity-cache", "off", "--irradiance-interpolation", "off",
                           "--denoise", "off"});
    all.insert(all.end(), options.begin(), options.end());
    Process process(all);
    std::this_thread::sleep_for(std::chrono::seconds(sanitized() ? 15 : 2));
    process.send(SIGINT);
    return process.wait(60);
  };
  const ProcessResult first = run({"-q"});
  EXPECT_EQ(first.exit_code, 130) << first.output;
  EXPECT_EQ(first.output.find("once more"), std::string::npos) << first.output;
  EXPECT_NE(first.output.find("the image is partial"), std::string::npos) << first.output;
  EXPECT_EQ(load_picture(image).width, 512);
  EXPECT_FALSE(std::filesystem::exists(partial));

  const auto time = std::filesystem::last_write_time(image);
  const ProcessResult second = run({});
  EXPECT_EQ(second.exit_code, 130) << second.output;
  EXPECT_EQ(std::filesystem::last_write_time(image), time);
  EXPECT_EQ(load_picture(partial).width, 512);
  EXPECT_NE(second.output.find(image + "\" is left as it was"), std::string::npos) << second.output;
  EXPECT_NE(second.output.find(partial), std::string::npos) << second.output;
}

TEST(SecondSignal, OfTheOtherKindEndsTheProgramAtOnce) {
  ScratchFolder folder;
  Process process({DAPPLE_BINARY, "render", source_path("scenes/cornell-box/cornell.pbrt"), "-o", folder.file("a.exr"),
                   "--integrator", "distribution", "--diffuse-rays", "65536", "--radiosity-cache", "off",
                   "--irradiance-interpolation", "off"});  // a block takes minutes
  ASSERT_TRUE(process.wait_until_it_answers(SIGINT, 60));
  std::this_thread::sleep_for(std::chrono::seconds(sanitized() ? 15 : 2));
  process.send(SIGINT);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  process.send(SIGTERM);
  EXPECT_EQ(process.wait(sanitized() ? 25 : 10).signal, SIGTERM);
}

// A block takes minutes. The bound is the promised second, and time for a loaded machine to write the image.
TEST_P(Interrupt, StopsWithinABlock) {
  ScratchFolder folder;
  const std::string image = folder.file("a.exr");
  Process process({DAPPLE_BINARY, "render", source_path("scenes/cornell-box/cornell.pbrt"), "-o", image, "--integrator",
                   "distribution", "--diffuse-rays", "65536", "--shadow-rays", "65536", "--resolution", "64x64"});
  ASSERT_TRUE(process.wait_until_it_answers(GetParam(), 60));
  std::this_thread::sleep_for(std::chrono::seconds(sanitized() ? 15 : 2));
  const auto start = std::chrono::steady_clock::now();
  process.send(GetParam());
  const ProcessResult result = process.wait(60);
  EXPECT_EQ(result.exit_code, 130) << result.output;
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), sanitized() ? 30 : 3);
  EXPECT_TRUE(std::filesystem::exists(image));
}

// Before rendering begins, there is nothing to save. Dicing for so many pixels takes half a minute; it is to end long
// before.
TEST_P(Interrupt, EndsLoadingAndSetUp) {
  ScratchFolder folder;
  const std::string image = folder.file("a.exr");
  Process process({DAPPLE_BINARY, "render", source_path("scenes/subdivision/figures.pbrt"), "-o", image, "--resolution",
                   "4096x4096", "--crop", "0,0,8,8"});
  ASSERT_TRUE(process.wait_until_it_answers(GetParam(), 60));
  std::this_thread::sleep_for(std::chrono::milliseconds(sanitized() ? 5000 : 2500));
  process.send(GetParam());
  const ProcessResult result = process.wait(sanitized() ? 60 : 8);
  EXPECT_EQ(result.exit_code, 130) << result.output;
  EXPECT_FALSE(std::filesystem::exists(image));
}

TEST(Hangup, IsIgnoredWhereItWasFromTheStart) {
  ScratchFolder folder;
  const std::string image = folder.file("a.exr");
  Process process({"/usr/bin/env", "--ignore-signal=HUP", DAPPLE_BINARY, "render",
                   source_path("scenes/cornell-box/cornell.pbrt"), "-o", image, "--resolution", "64x64",
                   "--pixel-samples", "1000000", "--time-limit", sanitized() ? "20" : "3"});
  std::this_thread::sleep_for(std::chrono::seconds(sanitized() ? 10 : 1));
  process.send(SIGHUP);
  const ProcessResult result = process.wait(90);
  EXPECT_EQ(result.exit_code, 0) << result.output;
}

constexpr const char* plot = R"(Camera "perspective"
WorldBegin
LightSource "distant" "rgb L" [ 2 2 2 ] "point3 from" [ 1 0 2 ] "point3 to" [ 0 0 0 ]
Shape "bilinearmesh" "point3 P" [ -2 -2 0  2 -2 0  -2 2 0  2 2 0 ]
Material "diffusetransmission"
Translate 0 0 1
Shape "sphere" "float radius" .5
)";

/// Layers that take seconds to solve.
std::string thick_canopy() {
  std::string layers, spectrum, light;
  for (int i = 0; i < 12; ++i)
    spectrum += (i ? ", " : "") + std::string("0.4"), light += (i ? ", " : "") + std::string("100");
  for (int i = 0; i < 10; ++i)
    layers += std::string(i ? ", " : "") + R"({"bottom_m": )" + std::to_string(i) + R"(, "top_m": )" +
              std::to_string(i + 1) + R"(, "leaf_area_index": 1, "reflectance": [)" + spectrum +
              R"(], "transmittance": [)" + spectrum + "]}";
  return R"({"layers": [)" + layers + R"(], "ground": {"reflectance": [)" + spectrum +
         R"(]}, "sky": {"type": "uniform", "irradiance_W_m2": [)" + light +
         R"(]}, "quadrature": {"nodes": 64, "modes": 24, "slabs": 20}})";
}

// All that the other commands do takes minutes here, but for `solve` with its second. There is nothing to save.
TEST_P(Interrupt, EndsOtherCommands) {
  const struct {
    const char* name;
    std::vector<std::string> arguments;
    int after_ms;
  } commands[] = {
      {"solve", {"canopy", "solve", "canopy.json", "-o", "out.json", "--exr", "out.exr"}, 50},
      {"measure", {"canopy", "measure", "plot.pbrt", "--gap-rays", "268435456", "-o", "out.json"}, 500},
      {"reflect", {"canopy", "reflect", "plot.pbrt", "--samples", "4194304", "--view", "0,0", "-o", "out.json"}, 500},
      {"penumbra",
       {"penumbra", "--mask-scene", "plot.pbrt", "--mask-width", "4", "--height", "1", "--sun-irradiance", "1",
        "--mask-pixels", "4096x4096", "--mask-samples", "1024", "-o", "out.exr"},
       500}};
  for (const auto& command : commands) {
    ScratchFolder folder;
    std::ofstream(folder.file("plot.pbrt")) << plot;
    std::ofstream(folder.file("canopy.json")) << thick_canopy();
    std::vector<std::string> arguments{DAPPLE_BINARY};
    arguments.insert(arguments.end(), command.arguments.begin(), command.arguments.end());
    Process process(arguments, folder.path().string());
    ASSERT_TRUE(process.wait_until_it_answers(GetParam(), 60)) << process.output();
    std::this_thread::sleep_for(std::chrono::milliseconds(command.after_ms));
    const auto start = std::chrono::steady_clock::now();
    process.send(GetParam());
    const ProcessResult result = process.wait(90);
    EXPECT_EQ(result.exit_code, 130) << command.name << ": " << result.output;
    EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), sanitized() ? 30 : 3)
        << command.name;
    EXPECT_NE(result.output.find("interrupted: there is no "), std::string::npos)
        << command.name << ": " << result.output;
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), std::filesystem::directory_iterator()),
              2)
        << command.name;
  }
}

bool is_writing(const ScratchFolder& folder) {
  for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
    if (entry.path().extension() == ".part") return true;
  return false;
}

// While an image with its layers is written, seconds long: one signal lets it be completed, and says so; a second one
// ends the program, and no part of a file is left. Writers of several parts make their file by themselves.
TEST(InterruptedWriting, CompletesTheFileOrLeavesNone) {
  for (const std::string parts : {"", "--multi-part"})
    for (const bool twice : {false, true}) {
      ScratchFolder folder;
      std::ofstream(folder.file("plot.pbrt")) << plot;
      std::vector<std::string> arguments{
          DAPPLE_BINARY,  "render",    "plot.pbrt",       "-o", "a.exr",     "--aov", "all",
          "--resolution", "1024x1024", "--pixel-samples", "1",  "--bounces", "0"};
      if (!parts.empty()) arguments.push_back(parts);
      Process process(arguments, folder.path().string());
      ASSERT_TRUE(process.wait_until_it_answers(SIGTERM, 60)) << process.output();
      for (int i = 0; i < 12000 && !is_writing(folder) && !std::filesystem::exists(folder.file("a.exr")); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      process.send(SIGTERM);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      if (twice) process.send(SIGINT);
      const ProcessResult result = process.wait(120);
      if (twice) {
        EXPECT_EQ(result.signal, SIGINT) << result.output;
        EXPECT_FALSE(std::filesystem::exists(folder.file("a.exr")));
      } else {
        EXPECT_EQ(result.exit_code, 130) << result.output;
        EXPECT_NE(result.output.find("interrupted when the image was whole"), std::string::npos) << result.output;
        EXPECT_EQ(load_picture(folder.file("a.exr")).width, 1024);
      }
      EXPECT_FALSE(is_writing(folder)) << parts;
    }
}

// Pictures of a day that were written before the signal are whole, and it is said.
TEST(InterruptedWriting, KeepsTheFramesBefore) {
  ScratchFolder folder;
  std::ofstream(folder.file("plot.pbrt")) << plot;
  Process process({DAPPLE_BINARY,
                   "penumbra",
                   "--mask-scene",
                   "plot.pbrt",
                   "--mask-width",
                   "4",
                   "--height",
                   "1",
                   "--sun-irradiance",
                   "1",
                   "--mask-pixels",
                   "256x256",
                   "--mask-samples",
                   "1",
                   "--location",
                   "0,0",
                   "--date",
                   "2024-06-21",
                   "--time-range",
                   "08:00-16:00",
                   "--frames",
                   "4000",
                   "-o",
                   "day.exr"},
                  folder.path().string());
  const std::string third = folder.file("day.0003.exr");
  for (int i = 0; i < 12000 && !std::filesystem::exists(third); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  process.send(SIGINT);
  const ProcessResult result = process.wait(90);
  EXPECT_EQ(result.exit_code, 130) << result.output;
  EXPECT_NE(result.output.find("the files written before are whole"), std::string::npos) << result.output;
  EXPECT_EQ(load_picture(third).width, 256);
  EXPECT_FALSE(is_writing(folder));
}

INSTANTIATE_TEST_SUITE_P(Signals, Interrupt, testing::Values(SIGINT, SIGTERM, SIGHUP), [](const auto& test) {
  return test.param == SIGINT ? "SIGINT" : test.param == SIGTERM ? "SIGTERM" : "SIGHUP";
});

}  // namespace
}  // namespace dapple::test
