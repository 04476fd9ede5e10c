// SPDX-License-Identifier: Apache-2.0
// DESIGN promise 5: an interrupt leaves the finished part of the image, whole, and exit code 130.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <filesystem>
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
  std::this_thread::sleep_for(std::chrono::seconds(sanitized() ? 15 : 2));
  EXPECT_FALSE(std::filesystem::exists(image)) << "written before it was whole";
  process.send(GetParam());
  const ProcessResult result = process.wait(60);
  EXPECT_EQ(result.exit_code, 130) << result.output;
  EXPECT_NE(result.output.find("interrupted: finishing what is under way; once more stops at once\n"), std::string::npos) << result.output;

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
    std::vector<std::string> all{DAPPLE_BINARY, "render", source_path("scenes/cornell-box/cornell.pbrt"), "-o", image, "--resolution", "512x512"};
    all.insert(all.end(), {"--threads", "1", "--integrator", "distribution", "--bounces", "1", "--diffuse-rays", "64", "--shadow-rays", "4",
                           "--radiosity-cache", "off", "--irradiance-interpolation", "off", "--denoise", "off"});
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
  Process process({DAPPLE_BINARY, "render", source_path("scenes/cornell-box/cornell.pbrt"), "-o", folder.file("a.exr"), "--integrator", "distribution",
                   "--diffuse-rays", "65536", "--radiosity-cache", "off", "--irradiance-interpolation", "off"});  // a block takes minutes
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
  Process process({DAPPLE_BINARY, "render", source_path("scenes/cornell-box/cornell.pbrt"), "-o", image, "--integrator", "distribution",
                   "--diffuse-rays", "65536", "--shadow-rays", "65536", "--resolution", "64x64"});
  std::this_thread::sleep_for(std::chrono::seconds(sanitized() ? 15 : 2));
  const auto start = std::chrono::steady_clock::now();
  process.send(GetParam());
  const ProcessResult result = process.wait(60);
  EXPECT_EQ(result.exit_code, 130) << result.output;
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), sanitized() ? 30 : 3);
  EXPECT_TRUE(std::filesystem::exists(image));
}

// Before rendering begins, there is nothing to save. Dicing for so many pixels takes half a minute; it is to end long before.
TEST_P(Interrupt, EndsLoadingAndSetUp) {
  ScratchFolder folder;
  const std::string image = folder.file("a.exr");
  Process process({DAPPLE_BINARY, "render", source_path("scenes/subdivision/figures.pbrt"), "-o", image, "--resolution", "4096x4096", "--crop", "0,0,8,8"});
  std::this_thread::sleep_for(std::chrono::milliseconds(sanitized() ? 5000 : 2500));
  process.send(GetParam());
  const ProcessResult result = process.wait(sanitized() ? 60 : 8);
  EXPECT_EQ(result.exit_code, 130) << result.output;
  EXPECT_FALSE(std::filesystem::exists(image));
}

TEST(Hangup, IsIgnoredWhereItWasFromTheStart) {
  ScratchFolder folder;
  const std::string image = folder.file("a.exr");
  Process process({"/usr/bin/env", "--ignore-signal=HUP", DAPPLE_BINARY, "render", source_path("scenes/cornell-box/cornell.pbrt"), "-o", image,
                   "--resolution", "64x64", "--pixel-samples", "1000000", "--time-limit", sanitized() ? "20" : "3"});
  std::this_thread::sleep_for(std::chrono::seconds(sanitized() ? 10 : 1));
  process.send(SIGHUP);
  const ProcessResult result = process.wait(90);
  EXPECT_EQ(result.exit_code, 0) << result.output;
}

INSTANTIATE_TEST_SUITE_P(Signals, Interrupt, testing::Values(SIGINT, SIGTERM, SIGHUP),
                         [](const auto& test) { return test.param == SIGINT ? "SIGINT" : test.param == SIGTERM ? "SIGTERM" : "SIGHUP"; });

}  // namespace
}  // namespace dapple::test
