// SPDX-License-Identifier: Apache-2.0
// dapple denoise --frames, as its users run it.
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "tests/support/dapple_program.h"
#include "tests/support/exr_layers.h"

namespace dapple::test {
namespace {

constexpr int frames = 4;

std::string name(const std::string& of, int frame) {
  return of + ".000" + std::to_string(frame) + ".exr";
}

double rms(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += std::pow(double(a[i]) - double(b[i]), 2);
  return std::sqrt(sum / double(a.size()));
}

/// A floor with a ball on it, seen by a camera that moves a little from frame to frame, rendered once for all tests.
class DenoiseSequence : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new ScratchFolder;
    for (int f = 1; f <= frames; ++f) {
      std::ofstream(file("scene.pbrt")) << "LookAt " << .02 * f << R"( -5 3  0 0 .5  0 0 1
Camera "perspective" "float fov" 40
WorldBegin
LightSource "infinite" "rgb L" [ .4 .5 .7 ] "string group" "sky"
AttributeBegin
Translate 1 -2 4
AreaLightSource "diffuse" "rgb L" [ 30 25 20 ] "string group" "lamp"
Shape "sphere" "float radius" .5
AttributeEnd
Material "diffuse" "rgb reflectance" [ .6 .5 .4 ]
Shape "bilinearmesh" "point3 P" [ -9 -9 0  9 -9 0  -9 9 0  9 9 0 ]
Translate 0 0 .7
Shape "sphere" "float radius" .7
)";
      const ProcessResult result =
          run_dapple({"render", file("scene.pbrt"), "-o", file(name("shot", f)), "--resolution", "64x48",
                      "--integrator", "path", "--pixel-samples", "4", "--seed", std::to_string(f), "--float",
                      "--light-groups", "--aov", "albedo,normal,depth,motion"},
                     120);
      ASSERT_EQ(result.exit_code, 0) << result.output;
    }
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }

  static std::string file(const std::string& of) { return folder_->file(of); }
  static ProcessResult denoise(const std::string& of, const std::string& output,
                               const std::vector<std::string>& options = {}) {
    std::vector<std::string> all{"denoise", "--frames", file(of), "-o", file(output)};
    all.insert(all.end(), options.begin(), options.end());
    return run_dapple(all, 120);
  }
  static void expect_refused(int code, const ProcessResult& result, const std::vector<std::string>& words) {
    EXPECT_EQ(result.exit_code, code) << result.output;
    for (const std::string& word : words) EXPECT_NE(result.output.find(word), std::string::npos) << result.output;
  }
  /// A copy of a frame, without a channel or header, or of another size.
  static void change(const std::string& from, const std::string& to, const std::string& leave_out, int width = 0) {
    const auto in = OIIO::ImageInput::open(file(from));
    ASSERT_TRUE(in);
    OIIO::ImageSpec spec = in->spec();
    std::vector<float> pixels(size_t(spec.width) * size_t(spec.height) * size_t(spec.nchannels));
    ASSERT_TRUE(in->read_image(0, 0, 0, -1, OIIO::TypeDesc::FLOAT, pixels.data()));
    for (std::string& channel : spec.channelnames)
      if (channel == leave_out) channel = "other";
    spec.erase_attribute(leave_out);
    if (width > 0) spec.width = spec.full_width = width;
    const auto out = OIIO::ImageOutput::create("openexr");
    ASSERT_TRUE(out->open(file(to), spec)) << out->geterror();
    ASSERT_TRUE(out->write_image(OIIO::TypeDesc::FLOAT, pixels.data()));
    ASSERT_TRUE(out->close());
  }

  static inline ScratchFolder* folder_ = nullptr;
};

TEST_F(DenoiseSequence, FramesCleanEachOther) {
  const ProcessResult result = denoise("shot.####.exr", "clean.####.exr");
  ASSERT_EQ(result.exit_code, 0) << result.output;
  ASSERT_EQ(denoise("shot.####.exr", "alone.####.exr", {"--neighbours", "0"}).exit_code, 0);
  ASSERT_EQ(run_dapple({"denoise", file(name("shot", 2)), "-o", file("single.exr")}, 120).exit_code, 0);
  const ExrLayers clean(file(name("clean", 2))), alone(file(name("alone", 2))), single(file("single.exr")),
      before(file(name("shot", 2)));
  for (const char* c : {"R", "G", "B"}) {
    EXPECT_EQ(alone[c], single[c]) << c;
    EXPECT_NE(clean[c], single[c]) << c;
    // Half the noise at most of what the network leaves differs; it is the same picture.
    EXPECT_LT(rms(clean[c], single[c]), .1) << c;
  }
  for (const std::string& other : before.names())
    if (other.size() > 1 && other.find("light.") != 0) {
      EXPECT_EQ(clean[other], before[other]) << other;
    }
  const std::string said = clean.text("dapple/denoised");
  EXPECT_EQ(said.find("by rt_hdr_alb_nrm.tza, "), 0u) << said;
  EXPECT_NE(said.find("by its neighbours: "), std::string::npos) << said;
  // What changes between frames of a floor in the same light is less.
  const ExrLayers next(file(name("clean", 3))), alone_next(file(name("alone", 3)));
  EXPECT_LT(rms(clean["G"], next["G"]), .9 * rms(alone["G"], alone_next["G"]));
}

TEST_F(DenoiseSequence, LightGroupsAddUp) {
  ASSERT_EQ(denoise("shot.####.exr", "groups.####.exr", {"--range", "2-3"}).exit_code, 0);
  const ExrLayers all(file(name("groups", 2)));
  for (const std::string c : {"R", "G", "B"})
    for (size_t i = 0; i < all[c].size(); ++i)
      ASSERT_NEAR(all["light.lamp." + c][i] + all["light.sky." + c][i], all[c][i], 1e-5f * all[c][i] + 1e-9f) << i;
}

TEST_F(DenoiseSequence, IsTheSameForAnyThreadsAndAnyPartOfTheFrames) {
  ASSERT_EQ(denoise("shot.####.exr", "one.####.exr", {"--threads", "1"}).exit_code, 0);
  ASSERT_EQ(denoise("shot.####.exr", "three.####.exr", {"--threads", "3", "-q"}).exit_code, 0);
  for (int f = 1; f <= frames; ++f)
    EXPECT_EQ(ExrLayers(file(name("one", f)))["G"], ExrLayers(file(name("three", f)))["G"]) << f;
  // Frame 4 depends on 2 and 3, frame 2 on the first too.
  ASSERT_EQ(denoise("shot.####.exr", "part.####.exr", {"--range", "2-4"}).exit_code, 0);
  EXPECT_EQ(ExrLayers(file(name("one", 4)))["G"], ExrLayers(file(name("part", 4)))["G"]);
  EXPECT_NE(ExrLayers(file(name("one", 2)))["G"], ExrLayers(file(name("part", 2)))["G"]);
}

TEST_F(DenoiseSequence, TakesRangesAndSteps) {
  ASSERT_EQ(denoise("shot.####.exr", "range.##.exr", {"--range", "1-4", "--step", "2"}).exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(file("range.01.exr")));
  EXPECT_FALSE(std::filesystem::exists(file("range.02.exr")));
  EXPECT_TRUE(std::filesystem::exists(file("range.03.exr")));
  ASSERT_EQ(denoise("shot.####.exr", "one_frame.#.exr", {"--range", "3"}).exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(file("one_frame.3.exr")));
  for (const int f : {1, 2, 4}) std::filesystem::copy_file(file(name("shot", f)), file(name("gap", f)));
  const ProcessResult gap = denoise("gap.####.exr", "gap_clean.####.exr");
  EXPECT_EQ(gap.exit_code, 0);
  EXPECT_NE(gap.output.find("missing between 2 and 4"), std::string::npos) << gap.output;
  // Frame 4 has no neighbour: it is what the network makes of it alone.
  ASSERT_EQ(run_dapple({"denoise", file(name("shot", 4)), "-o", file("fourth.exr")}, 120).exit_code, 0);
  EXPECT_EQ(ExrLayers(file(name("gap_clean", 4)))["G"], ExrLayers(file("fourth.exr"))["G"]);
}

TEST_F(DenoiseSequence, WarnsOnceOfWhatAllFramesLack) {
  for (int f = 1; f <= 3; ++f) change(name("shot", f), name("bare", f), "normal.X");
  const ProcessResult result = denoise("bare.####.exr", "bare_clean.####.exr");
  EXPECT_EQ(result.exit_code, 0) << result.output;
  for (const std::string said : {"denoised by colour alone", "without its neighbours: there is no layer of normals"}) {
    const size_t at = result.output.find(said);
    ASSERT_NE(at, std::string::npos) << said << result.output;
    EXPECT_EQ(result.output.find(said, at + 1), std::string::npos) << result.output;
  }
}

TEST_F(DenoiseSequence, DoesWithoutWhatHasNoNeighbours) {
  for (const std::string lack : {"worldToNDC", "Z"}) {
    for (int f = 1; f <= 2; ++f) change(name("shot", f), name("lack", f), lack);
    const ProcessResult result = denoise("lack.####.exr", "lack_clean.####.exr");
    EXPECT_EQ(result.exit_code, 0) << result.output;
    EXPECT_NE(result.output.find("without its neighbours"), std::string::npos) << result.output;
    EXPECT_NE(result.output.find(lack), std::string::npos) << result.output;
    ASSERT_EQ(run_dapple({"denoise", file(name("lack", 2)), "-o", file("lack.exr")}, 120).exit_code, 0);
    EXPECT_EQ(ExrLayers(file(name("lack_clean", 2)))["G"], ExrLayers(file("lack.exr"))["G"]);
  }
}

// Layers direct and variance too.
TEST_F(DenoiseSequence, WithoutNeighboursIsAsOneImage) {
  for (int f = 1; f <= 2; ++f) {
    const ProcessResult rendered =
        run_dapple({"render", file("scene.pbrt"), "-o", file(name("rich", f)), "--resolution", "64x48", "--integrator",
                    "path", "--pixel-samples", "512", "--seed", std::to_string(f), "--float", "--light-groups", "--aov",
                    "albedo,normal,depth,direct,variance"},
                   120);
    ASSERT_EQ(rendered.exit_code, 0) << rendered.output;
    change(name("rich", f), name("plain", f), "variance.R");
    change(name("rich", f), name("whole", f), "direct.R");
  }
  const auto single = [&](const std::string& of) {
    EXPECT_EQ(run_dapple({"denoise", file(name(of, 2)), "-o", file(of + ".exr")}, 120).exit_code, 0);
    return ExrLayers(file(of + ".exr"));
  };
  const ExrLayers one = single("rich");
  EXPECT_NE(one["G"], single("plain")["G"]);
  EXPECT_NE(one["G"], single("whole")["G"]);
  const ProcessResult result = denoise("rich.####.exr", "rich_alone.####.exr", {"--neighbours", "0"});
  ASSERT_EQ(result.exit_code, 0) << result.output;
  const ExrLayers alone(file(name("rich_alone", 2)));
  for (const char* c : {"R", "G", "B", "light.lamp.R", "light.sky.B"}) EXPECT_EQ(alone[c], one[c]) << c;
  EXPECT_EQ(alone.text("dapple/denoised"), one.text("dapple/denoised"));
  EXPECT_NE(result.output.find("denoised by itself"), std::string::npos) << result.output;
  ASSERT_EQ(denoise("rich.####.exr", "rich_clean.####.exr").exit_code, 0);
  EXPECT_NE(ExrLayers(file(name("rich_clean", 2)))["G"], one["G"]);
}

TEST_F(DenoiseSequence, SaysWhatIsWrong) {
  expect_refused(2, denoise("shot.exr", "out.####.exr"), {"--frames", "\"#\""});
  expect_refused(2, denoise("shot.####.exr", "out.exr"), {"--output", "\"#\""});
  expect_refused(2, denoise("a#b#.exr", "out.####.exr"), {"--frames"});
  expect_refused(2, denoise("shot.####.exr", "shot.####.exr"), {"shot.0001.exr"});
  expect_refused(2, denoise("shot.####.exr", "out.####.png"), {".exr"});
  for (const char* range : {"", "x", "3-1", "1-2-3", "-1", "1-99999999999"})
    EXPECT_EQ(denoise("shot.####.exr", "out.####.exr", {"--range=" + std::string(range)}).exit_code, 2) << range;
  expect_refused(2, denoise("shot.####.exr", "out.####.exr", {file(name("shot", 1))}), {"--frames"});
  expect_refused(2, run_dapple({"denoise", "-o", file("out.exr")}, 60), {"--frames"});
  expect_refused(2, run_dapple({"denoise", file(name("shot", 1)), "-o", file("out.exr"), "--range", "1-2"}, 60),
                 {"--range"});
  expect_refused(4, denoise("none.####.exr", "out.####.exr"), {"none.####.exr"});
  expect_refused(4, denoise("nowhere/shot.####.exr", "out.####.exr"), {"nowhere"});
  expect_refused(4, denoise("shot.####.exr", "out.####.exr", {"--range", "3-6"}), {"frame 5 is missing", "shot.0005"});
  EXPECT_FALSE(std::filesystem::exists(file(name("out", 3))));  // before any work
}

TEST_F(DenoiseSequence, SaysWhichFrameIsUnlikeTheFirst) {
  std::filesystem::copy_file(file(name("shot", 1)), file(name("size", 1)));
  change(name("shot", 2), name("size", 2), "", 60);
  expect_refused(3, denoise("size.####.exr", "out.####.exr"), {"size.0002.exr", "60 x 48", "64 x 48"});
  std::filesystem::copy_file(file(name("shot", 1)), file(name("layers", 1)));
  change(name("shot", 2), name("layers", 2), "normal.X");
  expect_refused(3, denoise("layers.####.exr", "out.####.exr"), {"layers.0002.exr", "normals"});
  std::filesystem::copy_file(file(name("shot", 1)), file(name("cut", 1)));
  std::ofstream(file(name("cut", 2))) << "This is no image.";
  expect_refused(3, denoise("cut.####.exr", "out.####.exr"), {"cut.0002.exr"});
}

}  // namespace
}  // namespace dapple::test
