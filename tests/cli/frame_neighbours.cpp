// SPDX-License-Identifier: Apache-2.0
// dapple render --previous --next, and what dapple denoise --frames makes of it.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/dapple_program.h"
#include "tests/support/exr_layers.h"

namespace dapple::test {
namespace {

/// A textured wall that is at x = 0, .1 and .4 in frames 1 to 3: no linear motion. 32 pixels show 8 m of it.
class FrameNeighbours : public testing::Test {
 protected:
  static constexpr const char* places[] = {"0", ".1", ".4"};

  std::string file(const std::string& name) const { return folder_.file(name); }
  std::string scene(int frame, const std::string& film = "", const std::string& more = "") const {
    const std::string name = file("frame." + std::to_string(frame) + film + ".pbrt");
    std::ofstream(name) << "LookAt 0 0 4  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 90\n"
                        << "Film \"rgb\" \"integer xresolution\" " << (film.empty() ? "32" : film)
                        << " \"integer yresolution\" 32\nPixelFilter \"box\"\nWorldBegin\n"
                        << "LightSource \"infinite\"\n"
                        << "Texture \"c\" \"spectrum\" \"checkerboard\" \"float uscale\" 40 \"float vscale\" 40\n"
                        << "Material \"diffuse\" \"texture reflectance\" \"c\"\nTranslate " << places[frame - 1]
                        << " 0 0\nShape \"bilinearmesh\" \"point3 P\" [ -20 -20 0  20 -20 0  -20 20 0  20 20 0 ]\n"
                        << more;
    return name;
  }
  ProcessResult render(int frame, const std::vector<std::string>& options) const {
    std::vector<std::string> all{"render",
                                 scene(frame),
                                 "-o",
                                 file("shot." + std::to_string(frame) + ".exr"),
                                 "--integrator",
                                 "path",
                                 "--pixel-samples",
                                 "4",
                                 "--bounces",
                                 "0",
                                 "--float",
                                 "--seed",
                                 std::to_string(frame)};
    all.insert(all.end(), options.begin(), options.end());
    return run_dapple(all, 120);
  }
  static void expect_all(const std::vector<float>& values, float expected) {
    for (const float v : values) ASSERT_NEAR(v, expected, 2e-3f);
  }

  ScratchFolder folder_;
};

// 4 pixels a metre; +x of the world is to the left.
TEST_F(FrameNeighbours, TellExactMotion) {
  const ProcessResult done = render(2, {"--previous", scene(1), "--next", scene(3), "--aov", "motion"});
  ASSERT_EQ(done.exit_code, 0) << done.output;
  const ExrLayers layers(file("shot.2.exr"));
  expect_all(layers["motion.X"], -1.2f);
  expect_all(layers["motion_back.X"], .4f);
  expect_all(layers["motion_back.Y"], 0);
  EXPECT_FALSE(layers.text("dapple/worldToNDCOfPrevious").empty());
  EXPECT_EQ(layers.text("dapple/shuttersAFrame"), "1");

  ASSERT_EQ(render(2, {"--aov", "motion"}).exit_code, 0);
  const ExrLayers alone(file("shot.2.exr"));
  expect_all(alone["motion.X"], 0);
  EXPECT_FALSE(alone.has("motion_back.X"));
}

// With both motions all of the neighbours is found again; without, the texture is elsewhere.
TEST_F(FrameNeighbours, HelpToDenoiseFrames) {
  const auto share = [&](bool exact) {
    for (int frame = 1; frame <= 3; ++frame) {
      std::vector<std::string> options{"--aov", "albedo,normal,depth,motion"};
      if (exact && frame > 1) options.insert(options.end(), {"--previous", scene(frame - 1)});
      if (exact && frame < 3) options.insert(options.end(), {"--next", scene(frame + 1)});
      const ProcessResult done = render(frame, options);
      EXPECT_EQ(done.exit_code, 0) << done.output;
    }
    const ProcessResult done = run_dapple({"denoise", "--frames", file("shot.#.exr"), "-o", file("clean.#.exr")}, 120);
    EXPECT_EQ(done.exit_code, 0) << done.output;
    const std::string text = ExrLayers(file("clean.2.exr")).text("dapple/denoised");
    const size_t at = text.find("neighbours: ");
    EXPECT_NE(at, std::string::npos) << text;
    return at == std::string::npos ? 0 : std::stoi(text.substr(at + 12));
  };
  const int exact = share(true), still = share(false);
  EXPECT_GT(exact, 75);  // the rest is beyond the edges
  EXPECT_LT(still, exact - 10);
}

TEST_F(FrameNeighbours, SayWhatTheyLack) {
  const std::string more = "Translate 0 0 1 Shape \"bilinearmesh\" \"point3 P\" [ -1 -1 0  1 -1 0  -1 1 0  1 1 0 ]\n";
  const ProcessResult done = render(2, {"--next", scene(3, "32", more), "--aov", "motion"});
  EXPECT_EQ(done.exit_code, 0) << done.output;
  EXPECT_NE(done.output.find("--next: 1 shapes and 0 instances"), std::string::npos) << done.output;
}

// Faults that frames have in common are said once; those of one alone are said too.
TEST_F(FrameNeighbours, RepeatNoWarnings) {
  const std::string odd = "LightSource \"infinite\" \"float oddity\" 1\n",
                    more = "Material \"diffuse\" \"float rarity\" 1\n";
  const ProcessResult done =
      run_dapple({"render", scene(2, "32", odd), "-o", file("shot.2.exr"), "--pixel-samples", "1", "--previous",
                  scene(1, "32", odd), "--next", scene(3, "32", odd + more), "--aov", "motion"},
                 120);
  EXPECT_EQ(done.exit_code, 0) << done.output;
  const auto count = [&](const std::string& word) {
    int n = 0;
    for (size_t at = done.output.find(word); at != std::string::npos; at = done.output.find(word, at + 1)) ++n;
    return n;
  };
  EXPECT_EQ(count("oddity"), 1) << done.output;
  EXPECT_EQ(count("rarity"), 1) << done.output;
}

// In folders whose names look like the end of a place, too; as often as one frame has them. What is printed is counted.
TEST_F(FrameNeighbours, CountTheirWarnings) {
  const auto spots = [](int times) {
    std::string text;
    for (int i = 0; i < times; ++i) text += "LightSource \"spot\" \"float coneangle\" 20 \"float conedeltaangle\" 30\n";
    return text;
  };
  const auto in_folder = [&](int frame, const std::string& more) {
    const std::string folder = file("take " + std::to_string(frame) + ": old");
    std::filesystem::create_directory(folder);
    std::filesystem::copy(scene(frame, "32", more), folder + "/frame.pbrt");
    return folder + "/frame.pbrt";
  };
  const ProcessResult done = run_dapple(
      {"render", in_folder(2, spots(2)), "-o", file("shot.2.exr"), "--pixel-samples", "1", "--previous",
       in_folder(1, spots(2)), "--next", in_folder(3, spots(3)), "--aov", "motion", "--stats", file("s.json")},
      120);
  EXPECT_EQ(done.exit_code, 0) << done.output;
  const auto count = [](const std::string& text, const std::string& word) {
    int n = 0;
    for (size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++n;
    return n;
  };
  EXPECT_EQ(count(done.output, "is cut to it"), 3) << done.output;
  std::ifstream in(file("s.json"));
  const std::string stats{std::istreambuf_iterator<char>(in), {}};
  EXPECT_NE(stats.find("\"warnings\": 3"), std::string::npos) << stats;
}

TEST_F(FrameNeighbours, WarnBeforeTheyFail) {
  std::ofstream(file("bad.pbrt")) << "WorldBegin\nLightSource \"infinite\" \"float scale\" 1 \"float scale\" 2\nShape";
  const ProcessResult done = render(2, {"--next", file("bad.pbrt"), "--aov", "motion"});
  EXPECT_EQ(done.exit_code, 3) << done.output;
  EXPECT_NE(done.output.find("is given twice"), std::string::npos) << done.output;
}

TEST_F(FrameNeighbours, RefuseWhatIsWrong) {
  const auto expect = [&](int code, const std::vector<std::string>& options, const std::string& word) {
    const ProcessResult done = render(2, options);
    EXPECT_EQ(done.exit_code, code) << done.output;
    EXPECT_NE(done.output.find(word), std::string::npos) << done.output;
  };
  expect(3, {"--next", scene(3, "48"), "--aov", "motion"}, "48 x 32 pixels; expected 32 x 32");
  expect(3, {"--previous", file("none.pbrt"), "--aov", "motion"}, "none.pbrt");
  expect(2, {"--next", scene(3), "--aov", "motion", "--watch"}, "--watch");
  std::ofstream(file("shot.2.exr")) << "an image";
  expect(2, {"--next", file("shot.2.exr"), "--aov", "motion"}, "shot.2.exr");
  expect(0, {"--next", scene(3)}, "--next has no effect without --aov motion");
  std::ofstream(file("round.pbrt"))
      << "Camera \"spherical\"\nFilm \"rgb\" \"integer xresolution\" 32 \"integer yresolution\" 32\n"
      << "WorldBegin\nLightSource \"infinite\"\nShape \"sphere\"\n";
  expect(3, {"--next", file("round.pbrt"), "--aov", "motion"}, "camera");
  std::ofstream(file("bad.pbrt")) << "Shape";
  expect(3, {"--next", file("bad.pbrt"), "--aov", "motion"}, "bad.pbrt:1");
}

}  // namespace
}  // namespace dapple::test
