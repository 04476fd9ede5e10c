// SPDX-License-Identifier: Apache-2.0
// dapple render --denoise, as its users run it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>

#include "tests/support/dapple_program.h"
#include "tests/support/exr_layers.h"

namespace dapple::test {
namespace {

const std::string cornell = source_path("scenes/cornell-box/cornell.pbrt");
const std::string network = source_path("data/denoise/rt_hdr_alb_nrm.tza");

class Denoise : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return folder_.file(name); }

  ProcessResult render_to(const std::string& image, std::vector<std::string> options,
                          const std::string& scene = cornell) const {
    options.insert(options.begin(), {"render", scene, "-o", file(image), "--resolution", "64x64", "--float"});
    return run_dapple(options, 120);
  }
  ExrLayers layers(const std::string& image, const std::vector<std::string>& options,
                   const std::string& scene = cornell) const {
    const ProcessResult result = render_to(image, options, scene);
    EXPECT_EQ(result.exit_code, 0) << result.output;
    return ExrLayers(file(image));
  }

  ScratchFolder folder_;
};

double rms(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += std::pow(double(std::min(a[i], 1.0f)) - double(std::min(b[i], 1.0f)), 2);
  return std::sqrt(sum / double(a.size()));
}

bool begins(const std::string& text, const std::string& with) {
  return text.compare(0, with.size(), with) == 0;
}

TEST_F(Denoise, GivesTheDenoisedImageAndTheNoisyOneBesideIt) {
  const std::vector<std::string> path{"--integrator", "path", "--pixel-samples", "8"};
  auto with = path, single = path, without = path;
  with.insert(with.end(), {"--denoise", "on", "--threads", "2"});
  single.insert(single.end(), {"--denoise", "on", "--threads", "1", "--aov", "albedo"});
  const ExrLayers on = layers("on.exr", with), off = layers("off.exr", without), one = layers("one.exr", single);
  EXPECT_EQ(off.text("dapple/denoised"), "no");
  EXPECT_TRUE(begins(on.text("dapple/denoised"), "by rt_hdr_alb_nrm.tza, ")) << on.text("dapple/denoised");
  EXPECT_EQ(on.names(), (std::vector<std::string>{"B", "G", "R", "noisy.B", "noisy.G", "noisy.R"}));
  for (const char* c : {"R", "G", "B"}) {
    EXPECT_EQ(on[std::string("noisy.") + c], off[c]) << c;
    EXPECT_EQ(on[c], one[c]) << c;
  }
  EXPECT_TRUE(one.has("albedo.R"));
  // Eight samples leave a display error of 10 %; the network takes three quarters and more of it away in all that was
  // measured.
  const ExrLayers reference =
      layers("reference.exr", {"--integrator", "path", "--pixel-samples", "1024", "--seed", "7", "--denoise", "off"});
  for (const char* c : {"R", "G", "B"}) EXPECT_LT(rms(on[c], reference[c]), .5 * rms(off[c], reference[c])) << c;
}

// Paths of the same random numbers, without bounces and with: their first light is the same, and so are lamps that are
// seen.
TEST_F(Denoise, DirectLightIsWhatLampsSendToWhatIsSeen) {
  const auto rendered = [&](const std::string& integrator, const std::string& bounces) {
    return layers(integrator + bounces + ".exr", {"--integrator", integrator, "--pixel-samples", "16", "--bounces",
                                                  bounces, "--denoise", "off", "--aov", "direct"});
  };
  const ExrLayers all = rendered("path", "4"), first = rendered("path", "0"), cached = rendered("distribution", "4");
  double lamps = 0, indirect = 0, of_cache = 0;
  for (const char* c : {"R", "G", "B"}) {
    const std::string direct = std::string("direct.") + c;
    for (size_t i = 0; i < all[c].size(); ++i) {
      ASSERT_NEAR(all[direct][i], first[direct][i], 1e-4f * (1 + first[direct][i])) << i;
      const float seen = first[c][i] - first[direct][i];  // the lamp
      lamps += double(seen);
      indirect += double(all[c][i] - all[direct][i] - seen);
      of_cache += double(cached[c][i] - cached[direct][i] - seen);
      if (seen > 1e-3f * first[c][i]) {
        EXPECT_LT(i / 64, 20) << i;  // it is on the ceiling
      }
    }
  }
  EXPECT_GT(lamps, 0);
  EXPECT_GT(indirect, 0);
  EXPECT_NEAR(of_cache / indirect, 1, .05);
  const ProcessResult grids =
      render_to("no.exr", {"--integrator", "distribution", "--preset", "final", "--aov", "direct"});
  EXPECT_EQ(grids.exit_code, 2) << grids.output;
  EXPECT_NE(grids.output.find("direct"), std::string::npos) << grids.output;
}

double mean(const std::vector<float>& values) {
  double sum = 0;
  for (const float v : values) sum += double(v);
  return sum / double(values.size());
}

// Root mean squares relative to light, as noise targets have it: of layer error, over those of what two references
// show, whose noise does not count. Of pixels with light: beside lamps filters with negative lobes make others.
double told_over_true(const ExrLayers& image, const ExrLayers& a, const ExrLayers& b) {
  double told = 0, true_one = 0;
  const double dark = .1 * mean(a["G"]);
  for (size_t i = 0; i < image["error"].size(); ++i) {
    if (std::min({a["R"][i], a["G"][i], a["B"][i], b["R"][i], b["G"][i], b["B"][i]}) < 0) continue;
    const double light = dark + (double(a["R"][i]) + double(a["G"][i]) + double(a["B"][i])) / 3;
    told += std::pow(double(image["error"][i]) / light, 2);
    for (const char* c : {"R", "G", "B"})
      true_one +=
          (double(image[c][i]) - double(a[c][i])) * (double(image[c][i]) - double(b[c][i])) / (3 * light * light);
  }
  return std::sqrt(told / true_one);
}

// Measured ratios: bench/run.py denoised_error.
TEST_F(Denoise, ErrorsThatAreLeftAreTold) {
  const std::vector<std::string> path{"--integrator", "path", "--aov", "error", "--pixel-samples"};
  const auto with = [&](const std::string& name, std::vector<std::string> more) {
    more.insert(more.begin(), path.begin(), path.end());
    return layers(name, more);
  };
  const ExrLayers a = layers("a.exr", {"--integrator", "path", "--pixel-samples", "256", "--seed", "7"}),
                  b = layers("b.exr", {"--integrator", "path", "--pixel-samples", "256", "--seed", "8"});
  for (const char* samples : {"8", "64"}) {
    const ExrLayers on = with("on.exr", {samples, "--denoise", "on"});
    EXPECT_NEAR(std::log(told_over_true(on, a, b)), 0, std::log(1.6)) << samples;
    const ExrLayers one = with("one.exr", {samples, "--denoise", "on", "--threads", "1"});
    EXPECT_EQ(one["error"], on["error"]);
  }
  const ExrLayers few = with("few.exr", {"4", "--denoise", "on"}), off = with("off.exr", {"4", "--denoise", "off"});
  EXPECT_TRUE(std::isinf(few["error"][0]));
  EXPECT_GT(mean(off["error"]), 0);
  EXPECT_TRUE(std::isfinite(mean(off["error"])));
}

// Weights of both signs are no noise of the light: where they count as such, .64 of the error is told under mitchell.
// Sinc is there against nonsense alone: of few samples its weights add up to about 0, and what is told is up to twice
// the error.
TEST_F(Denoise, ErrorsAreToldOfFiltersWithNegativeLobes) {
  std::ifstream in(cornell);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const size_t begin = text.find("PixelFilter"), end = text.find('\n', begin);
  ASSERT_NE(end, std::string::npos);
  for (const auto& [filter, factor] : {std::pair<std::string, double>("mitchell", 1.4), {"sinc", 2}}) {
    const std::string scene = file(filter + ".pbrt");
    std::ofstream(scene) << text.substr(0, begin) + "PixelFilter \"" + filter + "\"" + text.substr(end);
    const auto render = [&](const std::string& samples, const std::string& seed, const std::string& denoise) {
      return layers(
          "image.exr",
          {"--integrator", "path", "--pixel-samples", samples, "--seed", seed, "--denoise", denoise, "--aov", "error"},
          scene);
    };
    const ExrLayers a = render("256", "7", "off"), b = render("256", "8", "off"), on = render("32", "0", "on");
    EXPECT_NEAR(std::log(told_over_true(on, a, b)), 0, std::log(factor)) << filter;
  }
}

// Errors are smoothed: beside the crop's edge by what lies beyond it.
TEST_F(Denoise, ErrorsDoNotDependOnTheCrop) {
  const std::vector<std::string> options{"--integrator", "path", "--aov", "error", "--pixel-samples", "8"};
  std::vector<std::string> part = options;
  part.insert(part.end(), {"--crop", "10,20,30,50"});
  const ExrLayers whole = layers("whole.exr", options), crop = layers("crop.exr", part);
  ASSERT_EQ(crop["error"].size(), 20u * 30);
  for (size_t y = 0; y < 30; ++y)
    for (size_t x = 0; x < 20; ++x) ASSERT_EQ(crop["error"][20 * y + x], whole["error"][64 * (y + 20) + x + 10]) << x;
}

TEST_F(Denoise, NoiseTargetsAreReachedAfterIt) {
  const auto samples = [&](const std::string& target, const std::string& denoise, const std::string& threads) {
    return std::stoi(
        layers("a.exr", {"--integrator", "path", "--noise-target", target, "--denoise", denoise, "--threads", threads})
            .text("dapple/samples"));
  };
  const int coarse = samples(".15", "on", "2"), fine = samples(".07", "on", "2");
  EXPECT_GE(coarse, 8);
  EXPECT_LT(coarse, fine);
  EXPECT_EQ(samples(".15", "on", "1"), coarse);
  EXPECT_LT(fine, 512);
}

// Noisy blocks, which get more samples, are fewer after denoising.
TEST_F(Denoise, BlocksAreJudgedAfterIt) {
  const auto samples = [&](const std::string& denoise) {
    const ExrLayers image = layers("a.exr", {"--integrator", "path", "--pixel-samples", "16", "--max-pixel-samples",
                                             "64", "--pixel-noise", ".12", "--denoise", denoise, "--aov", "samples"});
    return mean(image["samples"]);
  };
  EXPECT_LT(samples("on"), .8 * samples("off"));
}

TEST_F(Denoise, PngGetsTheDenoisedImage) {
  ASSERT_EQ(render_to("a.exr", {"-o", file("a.png"), "--integrator", "path", "--pixel-samples", "2", "--denoise", "on"})
                .exit_code,
            0);
  const ExrLayers exr(file("a.exr"));
  const Picture png = load_picture(file("a.png"));
  ASSERT_EQ(png.width, 64);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      const float v = std::clamp(exr["G"][size_t(y) * 64 + size_t(x)], 0.0f, 1.0f);
      const float shown = v <= .0031308f ? 12.92f * v : 1.055f * std::pow(v, 1 / 2.4f) - .055f;
      ASSERT_NEAR(png.at(x, y)[1], shown, .6f / 255) << x << " " << y;
    }
}

TEST_F(Denoise, IsOnInPresetsOfFewSamples) {
  const auto said = [&](std::vector<std::string> options) {
    options.insert(options.end(), {"--pixel-samples", "1", "--bounces", "0"});
    return layers("a.exr", options).text("dapple/denoised");
  };
  EXPECT_TRUE(begins(said({"--integrator", "distribution"}), "by "));
  EXPECT_TRUE(begins(said({"--integrator", "distribution", "--preset", "draft"}), "by "));
  EXPECT_EQ(said({"--integrator", "distribution", "--preset", "final"}), "no");
  EXPECT_EQ(said({"--integrator", "distribution", "--denoise", "off"}), "no");
  EXPECT_EQ(said({"--integrator", "path"}), "no");
}

TEST_F(Denoise, ExposureHasBounds) {
  for (const char* exposure : {"1e38", "1e-38", "0", "-1", "nan"}) {
    const ProcessResult result =
        run_dapple({"render", cornell, "-o", file("a.exr"), "--denoise", "on", "--denoise-exposure", exposure}, 60);
    EXPECT_EQ(result.exit_code, 2) << exposure << "\n" << result.output;
    EXPECT_NE(result.output.find("--denoise-exposure"), std::string::npos) << result.output;
  }
}

TEST_F(Denoise, ScenesAskForIt) {
  const auto said =
      [&](const std::string& integrator, const std::vector<std::string>& options) {
        std::ofstream(file("scene.pbrt"))
            << "Integrator " << integrator
            << "\nCamera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\nTranslate 0 0 4\nShape \"sphere\"\n";
        std::vector<std::string> all{"--pixel-samples", "1", "--crop", "10,10,30,40"};
        all.insert(all.end(), options.begin(), options.end());
        return layers("a.exr", all, file("scene.pbrt")).text("dapple/denoised");
      };
  const std::string by_itself = said("\"path\" \"bool denoise\" true", {});
  EXPECT_TRUE(begins(by_itself, "by rt_hdr_alb_nrm.tza") && by_itself.find("crop") != std::string::npos) << by_itself;
  EXPECT_EQ(said("\"path\" \"bool denoise\" true", {"--denoise", "off"}), "no");
  EXPECT_EQ(said("\"distribution\" \"bool denoise\" false", {}), "no");
}

// What is beyond 87 pixels has no part in a pixel; of what is beyond the border of 32 little is left, once exposure is
// that of the whole frame: 1 % of the noise; 1.7 % where the border does not begin at a multiple of 16.
TEST_F(Denoise, CropsAreNearlyPartsOfTheWhole) {
  const auto rendered = [&](const std::string& image, const std::vector<std::string>& options) {
    std::vector<std::string> all{"render",  cornell,     "-o",           file(image), "--resolution",
                                 "160x160", "--float",   "--integrator", "path",      "--pixel-samples",
                                 "4",       "--denoise", "on",           "--aov",     "albedo,depth"};
    all.insert(all.end(), options.begin(), options.end());
    const ProcessResult result = run_dapple(all, 120);
    EXPECT_EQ(result.exit_code, 0) << result.output;
    return ExrLayers(file(image));
  };
  const ExrLayers whole = rendered("whole.exr", {});
  const ExrLayers crop =
      rendered("crop.exr", {"--crop", "64,56,112,96", "--denoise-exposure", whole.text("dapple/denoiseExposure")});
  ASSERT_EQ(crop.width(), 48);
  ASSERT_EQ(crop.height(), 40);
  EXPECT_EQ(crop.text("dapple/denoiseExposure"), whole.text("dapple/denoiseExposure"));
  const auto part = [&](const std::string& channel) {
    std::vector<float> pixels;
    for (size_t y = 56; y < 96; ++y)
      for (size_t x = 64; x < 112; ++x) pixels.push_back(whole[channel][y * 160 + x]);
    return pixels;
  };
  for (const char* c : {"noisy.R", "noisy.G", "noisy.B", "albedo.G", "Z"}) EXPECT_EQ(crop[c], part(c)) << c;
  for (const char* c : {"R", "G", "B"}) {
    const double off = rms(crop[c], part(c)), noise = rms(crop[std::string("noisy.") + c], part(c));
    EXPECT_LT(off, .013 * noise) << c;
  }
  const ExrLayers own = rendered("own.exr", {"--crop", "64,56,112,96"});
  EXPECT_NE(own.text("dapple/denoiseExposure"), whole.text("dapple/denoiseExposure"));
}

// A checker much finer than what albedo shows, since it is in the light: 64 samples of it are clean, and it stays.
TEST_F(Denoise, CleanPicturesStay) {
  std::ofstream(file("scene.pbrt")) << R"(LookAt 0 0 5  0 0 0  0 1 0
Camera "perspective" "float fov" 30
PixelFilter "box"
WorldBegin
LightSource "infinite" "rgb L" [ 1 1 1 ]
Texture "checks" "spectrum" "checkerboard" "float uscale" 64 "float vscale" 64 "rgb tex1" [ .1 .1 .1 ] "rgb tex2" [ .9 .9 .9 ]
Material "diffuse" "texture reflectance" "checks"
Shape "bilinearmesh" "point3 P" [ -2 -2 0  2 -2 0  -2 2 0  2 2 0 ]
)";
  const ExrLayers all = layers("clean.exr",
                               {"--integrator", "path", "--pixel-samples", "64", "--bounces", "1", "--denoise", "on",
                                "--aov", "albedo,normal,variance,direct"},
                               file("scene.pbrt"));
  for (const std::string c : {"R", "G", "B"}) {
    double variance = 0;
    for (const float v : all["variance." + c]) variance += double(v);
    // Not farther off than the noise.
    EXPECT_LT(rms(all[c], all["noisy." + c]), 1.5 * std::sqrt(variance / 4096)) << c;
  }
  // The file tells all that it takes to do the same again.
  ASSERT_EQ(run_dapple({"denoise", file("clean.exr"), "-o", file("again.exr")}, 60).exit_code, 0);
  EXPECT_EQ(ExrLayers(file("again.exr"))["G"], all["G"]);
}

TEST_F(Denoise, LightGroupsAddUp) {
  std::ofstream(file("scene.pbrt")) << R"(Camera "perspective"
WorldBegin
LightSource "point" "rgb I" [ 9 5 3 ] "point3 from" [ 2 3 0 ] "string group" "key"
LightSource "infinite" "rgb L" [ .1 .2 .4 ] "string group" "sky"
Translate 0 0 4
Shape "sphere"
Shape "bilinearmesh" "point3 P" [ -9 -1 -9  9 -1 -9  -9 -1 9  9 -1 9 ]
)";
  const ExrLayers all =
      layers("a.exr", {"--integrator", "path", "--pixel-samples", "4", "--light-groups", "--denoise", "on"},
             file("scene.pbrt"));
  for (const std::string c : {"R", "G", "B"})
    for (size_t i = 0; i < all[c].size(); ++i)
      ASSERT_NEAR(all["light.key." + c][i] + all["light.sky." + c][i], all[c][i], 1e-5f * all[c][i] + 1e-9f) << i;
}

TEST_F(Denoise, SaysWhereWeightsAreMissing) {
  const std::vector<std::string> quick{"--pixel-samples", "1", "--bounces", "0"};
  const auto with = [&](std::vector<std::string> options) {
    options.insert(options.end(), quick.begin(), quick.end());
    return options;
  };
  ASSERT_EQ(setenv("DAPPLE_WEIGHTS", folder_.path().c_str(), 1), 0);
  const ProcessResult asked = render_to("a.exr", with({"--integrator", "path", "--denoise", "on"}));
  const ProcessResult preset = render_to("b.exr", with({"--integrator", "distribution"}));
  const ProcessResult named = render_to("c.exr", with({"--integrator", "distribution", "--denoise-weights", network}));
  ASSERT_EQ(unsetenv("DAPPLE_WEIGHTS"), 0);
  EXPECT_EQ(asked.exit_code, 4) << asked.output;
  EXPECT_NE(asked.output.find("rt_hdr_alb_nrm.tza"), std::string::npos) << asked.output;
  EXPECT_EQ(preset.exit_code, 0) << preset.output;
  EXPECT_NE(preset.output.find("not denoised"), std::string::npos) << preset.output;
  EXPECT_EQ(ExrLayers(file("b.exr")).text("dapple/denoised"), "no: the weights are missing");
  EXPECT_EQ(named.exit_code, 0) << named.output;
}

TEST_F(Denoise, TakesOtherWeights) {
  const auto run = [&](const std::string& weights) {
    return render_to("a.exr",
                     {"--integrator", "path", "--pixel-samples", "1", "--denoise", "on", "--denoise-weights", weights});
  };
  EXPECT_EQ(run(source_path("data/denoise/rt_hdr.tza")).exit_code, 0);
  EXPECT_TRUE(begins(ExrLayers(file("a.exr")).text("dapple/denoised"), "by rt_hdr.tza"));
  EXPECT_EQ(run(file("none.tza")).exit_code, 4);
  std::ofstream(file("text.tza")) << "These are no weights.";
  const ProcessResult text = run(file("text.tza"));
  EXPECT_EQ(text.exit_code, 3) << text.output;
  EXPECT_NE(text.output.find("text.tza"), std::string::npos) << text.output;
  EXPECT_EQ(render_to("b.exr", {"--integrator", "path", "--pixel-samples", "1", "--denoise", "maybe"}).exit_code, 2);
  const ProcessResult unused =
      render_to("b.exr", {"--integrator", "path", "--pixel-samples", "1", "--denoise-weights", network});
  EXPECT_EQ(unused.exit_code, 0);
  EXPECT_NE(unused.output.find("--denoise-weights"), std::string::npos) << unused.output;
}

TEST_F(Denoise, FollowsATimeLimit) {
  const ExrLayers limited = layers("a.exr", {"--integrator", "path", "--time-limit", "1", "--denoise", "on"});
  EXPECT_TRUE(begins(limited.text("dapple/denoised"), "by "));
  EXPECT_TRUE(limited.has("noisy.R"));
}

}  // namespace
}  // namespace dapple::test
