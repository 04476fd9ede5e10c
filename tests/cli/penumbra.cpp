// SPDX-License-Identifier: Apache-2.0
// `dapple penumbra` as docs/guide/penumbra.md describes it.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include "dapple/image/image_writer.h"
#include "tests/support/dapple_program.h"

namespace dapple::test {
namespace {

using nlohmann::json;

void write_mask(const std::string& path, int width, int height, const std::function<float(int, int)>& at) {
  image::OutputImage out;
  out.width = width;
  out.height = height;
  image::ImageLayer layer{"", {"Y"}, {}, image::SampleType::full_float};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) layer.pixels.push_back(at(x, y));
  out.layers.push_back(layer);
  image::write_exr(path, out);
}

float leaves(int x, int y) {
  return (x / 5 + y / 3) % 2 ? 0.1f : 0.9f;
}

std::string bytes_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class PenumbraCommand : public testing::Test {
 protected:
  PenumbraCommand() { write_mask(mask_, 40, 30, leaves); }

  ProcessResult run(std::vector<std::string> options, const std::string& mask = "mask.exr") {
    std::vector<std::string> arguments{"penumbra", "--mask", mask, "--mask-width", "4",
                                       "--height", "2",      "-o", "out.exr"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return run_dapple(arguments, 60, folder_.path().string());
  }
  /// As run, with the default of one option replaced.
  ProcessResult run_with(const std::string& option, const std::string& value) {
    std::vector<std::string> arguments{"penumbra", "--mask",           "mask.exr", "--mask-width", "4",      "--height",
                                       "2",        "--sun-irradiance", "100",      "-o",           "out.exr"};
    const auto at = std::find(arguments.begin(), arguments.end(), option);
    if (at != arguments.end())
      at[1] = value;
    else
      arguments.insert(arguments.end(), {option, value});
    return run_dapple(arguments, 60, folder_.path().string());
  }

  ScratchFolder folder_;
  const std::string mask_ = folder_.file("mask.exr"), out_ = folder_.file("out.exr");
};

// Rationale: the stable options. Expectation: the sun's beam moves the mask towards it by h tan(zenith): here 3 pixels
// to the right and 4 up, and the uniform sky of a mask that repeats adds up to the mask's mean.
TEST_F(PenumbraCommand, SunAndSky) {
  const double zenith = std::atan(0.5 / 2) * 180 / std::numbers::pi,
               azimuth = std::atan2(4.0, 3.0) * 180 / std::numbers::pi;
  const ProcessResult sun =
      run({"--sun-zenith", std::to_string(zenith), "--sun-azimuth", std::to_string(azimuth), "--sun-irradiance", "100",
           "--sun-diameter", ".001", "--sky-irradiance", "0", "--periodic"});
  ASSERT_EQ(sun.exit_code, 0) << sun.output;
  const Picture e = load_picture(out_);
  ASSERT_EQ(e.width, 40);
  ASSERT_EQ(e.height, 30);
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 40; ++x)
      EXPECT_NEAR(e.at(x, y)[0],
                  100 * std::cos(zenith * std::numbers::pi / 180) * double(leaves((x + 3) % 40, (y + 26) % 30)), 0.01)
          << x << "," << y;

  const ProcessResult sky = run({"--sky", "uniform", "--sky-irradiance", "50", "--periodic", "--stats", "stats.json"});
  ASSERT_EQ(sky.exit_code, 0) << sky.output;
  const json stats = json::parse(std::ifstream(folder_.file("stats.json")));
  EXPECT_NEAR(stats["frames"][0]["mean_irradiance"][0].get<double>(), 25, 0.01);
  EXPECT_NEAR(stats["frames"][0]["open_irradiance"]["sky"][1].get<double>(), 50, 1e-4);
  EXPECT_NEAR(stats["mask"]["pitch_m"].get<double>(), 0.1, 1e-12);
  EXPECT_GT(stats["peak_rss_bytes"].get<double>(), 1e6);
}

TEST_F(PenumbraCommand, SameBytesForAnyNumberOfThreads) {
  std::string first;
  for (const char* threads : {"1", "2", "4"}) {
    const ProcessResult r = run({"--sun-zenith", "35", "--sun-irradiance", "800", "--sky", "preetham",
                                 "--sky-irradiance", "100", "--threads", threads});
    ASSERT_EQ(r.exit_code, 0) << r.output;
    const std::string bytes = bytes_of(out_);
    if (first.empty()) first = bytes;
    EXPECT_EQ(bytes, first) << threads;
  }
}

TEST_F(PenumbraCommand, AnimatesADay) {
  const ProcessResult r = run({"--sun-irradiance", "800", "--location", "47,8", "--date", "2024-06-21", "--time-range",
                               "06:00-16:00", "--frames", "3", "-o", "day.png", "--stats", "stats.json"});
  ASSERT_EQ(r.exit_code, 0) << r.output;
  for (const char* name : {"out.0001.exr", "out.0003.exr", "day.0002.png"})
    EXPECT_TRUE(std::filesystem::exists(folder_.file(name))) << name;
  const json frames = json::parse(std::ifstream(folder_.file("stats.json")))["frames"];
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_LT(std::abs(frames[0]["sun_azimuth_deg"].get<double>()), 25);  // in the east, +x
  EXPECT_LT(frames[1]["sun_zenith_deg"].get<double>(), 26);
  EXPECT_EQ(frames[2]["time"], "2024-06-21 16:00 UT");
  // At night there is none.
  const ProcessResult night =
      run({"--sun-irradiance", "800", "--location", "47,8", "--date", "2024-06-21", "--time-range", "01:00-02:00"});
  EXPECT_EQ(night.exit_code, 3) << night.output;
  EXPECT_NE(night.output.find("above the horizon"), std::string::npos) << night.output;
}

TEST_F(PenumbraCommand, MaskFromAScene) {
  std::ofstream(folder_.file("post.pbrt")) << R"(LookAt 0 -5 2  0 0 1  0 0 1 Camera "perspective" WorldBegin
    LightSource "infinite"
    Shape "bilinearmesh" "point3 P" [ -9 -9 0  9 -9 0  -9 9 0  9 9 0 ]
    Shape "bilinearmesh" "point3 P" [ 0 0 1  1 0 1  0 1 1  1 1 1 ])";
  const ProcessResult r =
      run_dapple({"penumbra", "--mask-scene", "post.pbrt", "--mask-pixels", "16x8", "--mask-width", "4", "--height",
                  "1", "--sun-irradiance", "1", "--write-mask", "made.exr", "-o", "out.exr"},
                 60, folder_.path().string());
  ASSERT_EQ(r.exit_code, 0) << r.output;
  const Picture made = load_picture(folder_.file("made.exr"));
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 16; ++x) EXPECT_EQ(made.at(x, y)[0], x >= 8 && x < 12 && y < 4 ? 0 : 1) << x << "," << y;
}

TEST_F(PenumbraCommand, BadNumbersAreNamed) {
  const struct {
    const char *option, *value, *says;
  } cases[] = {
      {"--height", "0", "--height is 0, expected metres above 0"},
      {"--height", "-3", "--height is -3"},
      {"--height", "nan", "--height is nan"},
      {"--mask-width", "0", "--mask-width is 0, expected metres above 0"},
      {"--mask-width", "nan", "--mask-width is nan"},
      {"--mask-width", "inf", "--mask-width is inf"},
      {"--sun-zenith", "91", "--sun-zenith is 91, expected 0 to below 89.7335 degrees"},
      {"--sun-zenith", "-1", "--sun-zenith is -1"},
      {"--sun-zenith", "nan", "--sun-zenith is nan"},
      {"--sun-azimuth", "nan", "--sun-azimuth is nan"},
      {"--sun-irradiance", "-5", "--sun-irradiance is -5, expected W m^-2 from 0"},
      {"--sun-irradiance", "nan", "--sun-irradiance is nan"},
      {"--sky-irradiance", "-5", "--sky-irradiance is -5, expected W m^-2 from 0"},
      {"--sky-irradiance", "nan", "--sky-irradiance is nan"},
      {"--turbidity", "1", "--turbidity is 1, expected a number from 1.9 to 10"},
      {"--sky-cell", "nan", "--sky-cell is nan"},
      {"--png-white", "0", "--png-white is 0"},
      {"--sky", "absent.exr", "absent.exr"},
      {"--sun-image", "absent.exr", "absent.exr"},
      {"--mask", "absent.exr", "absent.exr"},
      {"--mask-scene", "absent.pbrt", ""},
  };
  for (const auto& c : cases) {
    const ProcessResult r = run_with(c.option, c.value);
    EXPECT_EQ(r.exit_code, std::string(c.option) == "--mask-scene" ? 2 : 3)
        << c.option << " " << c.value << ": " << r.output;
    EXPECT_NE(r.output.find(c.says), std::string::npos) << r.output;
    EXPECT_FALSE(std::filesystem::exists(out_));
  }
  for (const char* option : {"--frames", "--height", "--sky-irradiance"})
    EXPECT_EQ(run_with(option, "many").exit_code, 2) << option;
  EXPECT_EQ(run({"--height", "3", "--sun-irradiance", "1"}).exit_code, 2) << "two heights for one mask";
  EXPECT_EQ(run({}).exit_code, 2) << "no light";
  EXPECT_EQ(run({"--sun-irradiance", "1", "--date", "2024-01-01"}).exit_code, 2);
  EXPECT_EQ(
      run({"--sun-irradiance", "1", "--location", "91,0", "--date", "2024-01-01", "--time-range", "12:00"}).exit_code,
      3);
  EXPECT_EQ(
      run({"--sun-irradiance", "1", "--location", "0,0", "--date", "2023-02-29", "--time-range", "12:00"}).exit_code,
      3);
  EXPECT_EQ(run({"--sun-irradiance", "1", "--location", "0,0", "--date", "2023-02-28", "--time-range", "13:00-12:00"})
                .exit_code,
            3);
}

TEST_F(PenumbraCommand, BadMasksAreNamed) {
  const float not_a_number = std::numeric_limits<float>::quiet_NaN();
  for (const float bad : {not_a_number, -0.25f, 1.5f, std::numeric_limits<float>::infinity()}) {
    write_mask(folder_.file("bad.exr"), 8, 8, [&](int x, int y) { return x == 5 && y == 6 ? bad : 1.0f; });
    const ProcessResult r = run({"--sun-irradiance", "100"}, "bad.exr");
    EXPECT_EQ(r.exit_code, 3) << bad << r.output;
    EXPECT_NE(r.output.find("bad.exr"), std::string::npos) << r.output;
    EXPECT_NE(r.output.find("pixel 5, 6"), std::string::npos) << r.output;
    EXPECT_NE(r.output.find("from 0 to 1"), std::string::npos) << r.output;
    EXPECT_FALSE(std::filesystem::exists(out_));
  }
  std::ofstream(folder_.file("empty.exr"));
  EXPECT_EQ(run({"--sun-irradiance", "100"}, "empty.exr").exit_code, 3);
  const std::string whole = bytes_of(mask_);
  std::ofstream(folder_.file("cut.exr"), std::ios::binary) << whole.substr(0, whole.size() / 2);
  EXPECT_EQ(run({"--sun-irradiance", "100"}, "cut.exr").exit_code, 3);
  write_mask(folder_.file("sky.exr"), 8, 4, [&](int, int) { return not_a_number; });
  const ProcessResult sky = run({"--sky", "sky.exr", "--sky-irradiance", "10"});
  EXPECT_EQ(sky.exit_code, 3) << sky.output;
  EXPECT_NE(sky.output.find("sky.exr"), std::string::npos);
}

}  // namespace
}  // namespace dapple::test
