// SPDX-License-Identifier: Apache-2.0
// Rationale: distribution ray tracing against the path tracer in scenes with textures, displacement, foliage and mixed
// materials. Expectation: without the cache means a channel and block averages (relative RMSE) within 3 %; presets,
// which cache and interpolate, within what each case says. Both sides take enough samples that noise is a third of that
// or less; each suite says what was seen.
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/dapple_program.h"

namespace dapple::test {
namespace {

struct SceneCase {
  const char* name;
  const char* scene;
  bool shared;  ///< of the scenes beside the repository
  std::vector<std::string> view;
  std::string bounces, path_samples, samples, shadow_rays, diffuse_rays;
  int block;
};

void PrintTo(const SceneCase& s, std::ostream* out) {
  *out << s.name;
}

class DistributionScene : public testing::TestWithParam<SceneCase> {};

TEST_P(DistributionScene, AgreesWithThePathTracer) {
  const SceneCase& s = GetParam();
  const std::string scene = s.shared ? shared_path(s.scene) : source_path(s.scene);
  if (!std::filesystem::exists(scene)) GTEST_SKIP() << "absent: " << scene;

  std::vector<std::string> path{"--integrator",    "path",         "--bounces", s.bounces,
                                "--pixel-samples", s.path_samples, "--seed",    "1"};
  std::vector<std::string> grids{"--integrator",
                                 "distribution",
                                 "--radiosity-cache",
                                 "off",
                                 "--irradiance-interpolation",
                                 "off",
                                 "--caustics",
                                 "on",
                                 "--bounces",
                                 s.bounces,
                                 "--pixel-samples",
                                 s.samples,
                                 "--shadow-rays",
                                 s.shadow_rays,
                                 "--diffuse-rays",
                                 s.diffuse_rays};
  for (auto* options : {&path, &grids}) options->insert(options->end(), s.view.begin(), s.view.end());
  const Picture expected = render(scene, path, 1200);
  const Picture picture = render(scene, grids, 1200);

  const Comparison c = compare(picture, expected, Mask(expected.width, expected.height), s.block);
  EXPECT_LT(c.max_mean_error(), 0.03) << c.to_text();
  EXPECT_LT(c.block_rmse, 0.03) << c.to_text();
  std::printf("%s", c.to_text().c_str());
}

std::string name_of(const testing::TestParamInfo<SceneCase>& info) {
  return info.param.name;
}

// Seen: means within .9, .1, .1, .5 %, blocks 1.3, .6, .8, 1.7 %. The classroom is its back wall, beside the patches of
// sun: what the sun sends on from polished wood and steel to them is found by neither side in any time that a test has.
INSTANTIATE_TEST_SUITE_P(Quick, DistributionScene,
                         testing::Values(SceneCase{"displaced_figures",
                                                   "scenes/subdivision/figures.pbrt",
                                                   false,
                                                   {"--resolution", "320x180", "--crop", "80,40,240,140"},
                                                   "2",
                                                   "64",
                                                   "4",
                                                   "8,2",
                                                   "16,2",
                                                   20},
                                         SceneCase{"tree",
                                                   "scenes/forest/tree.pbrt",
                                                   true,
                                                   {"--resolution", "240x135", "--crop", "80,20,160,130"},
                                                   "2",
                                                   "64",
                                                   "16",
                                                   "8,1",
                                                   "8,1",
                                                   10},
                                         SceneCase{"staircase2",
                                                   "scenes/staircase2/scene-v4.pbrt",
                                                   true,
                                                   {"--resolution", "160x160", "--crop", "40,0,140,40"},
                                                   "1",
                                                   "256",
                                                   "16",
                                                   "8,2",
                                                   "32,2",
                                                   20},
                                         SceneCase{"classroom",
                                                   "scenes/classroom/scene-v4.pbrt",
                                                   true,
                                                   {"--resolution", "320x180", "--crop", "80,60,128,108"},
                                                   "1",
                                                   "512",
                                                   "16",
                                                   "8,2",
                                                   "512,2",
                                                   24}),
                         name_of);

// Seen: means within .7, .1, .1, .6 %, blocks 1.2, .3, .7, 1.4 %.
INSTANTIATE_TEST_SUITE_P(Long, DistributionScene,
                         testing::Values(SceneCase{"displaced_figures",
                                                   "scenes/subdivision/figures.pbrt",
                                                   false,
                                                   {"--resolution", "320x180"},
                                                   "2",
                                                   "256",
                                                   "16",
                                                   "16,2",
                                                   "16,2",
                                                   20},
                                         SceneCase{"tree",
                                                   "scenes/forest/tree.pbrt",
                                                   true,
                                                   {"--resolution", "240x135", "--crop", "60,20,180,130"},
                                                   "2",
                                                   "128",
                                                   "32",
                                                   "8,1",
                                                   "8,1",
                                                   10},
                                         SceneCase{"staircase2",
                                                   "scenes/staircase2/scene-v4.pbrt",
                                                   true,
                                                   {"--resolution", "200x200"},
                                                   "1",
                                                   "256",
                                                   "16",
                                                   "8,2",
                                                   "32,2",
                                                   25},
                                         SceneCase{"classroom",
                                                   "scenes/classroom/scene-v4.pbrt",
                                                   true,
                                                   {"--resolution", "320x180", "--crop", "64,40,176,112"},
                                                   "1",
                                                   "2048",
                                                   "16",
                                                   "8,2",
                                                   "512,2",
                                                   36}),
                         name_of);

struct PresetCase {
  const char* name;
  const char* scene;
  bool shared;
  std::vector<std::string> view;
  std::string path_samples, preset;
  int block, seeds;  ///< pictures whose mean is compared: that of one wavers with its seed, by .1, .8 (`preview`, few
                     ///< cells) and .5 % in the scenes below
  double mean_bound, block_bound;
};

void PrintTo(const PresetCase& s, std::ostream* out) {
  *out << s.name;
}

class PresetScene : public testing::TestWithParam<PresetCase> {};

TEST_P(PresetScene, AgreesWithThePathTracer) {
  const PresetCase& s = GetParam();
  const std::string scene = s.shared ? shared_path(s.scene) : source_path(s.scene);
  if (!std::filesystem::exists(scene)) GTEST_SKIP() << "absent: " << scene;

  std::vector<std::string> path{"--integrator",    "path",         "--bounces", "4",
                                "--pixel-samples", s.path_samples, "--seed",    "1"};
  std::vector<std::string> preset{"--integrator", "distribution", "--preset", s.preset, "--bounces", "4"};
  if (s.preset == "preview") preset.insert(preset.end(), {"--pixel-samples", "16"});  // in place of the scenes' 64
  for (auto* options : {&path, &preset}) options->insert(options->end(), s.view.begin(), s.view.end());
  const Picture expected = render(scene, path, 1200);
  Picture mean = render(scene, preset, 1200);
  for (int seed = 1; seed < s.seeds; ++seed) {
    std::vector<std::string> other = preset;
    other.insert(other.end(), {"--seed", std::to_string(seed)});
    const Picture picture = render(scene, other, 1200);
    for (size_t i = 0; i < mean.rgb.size(); ++i) mean.rgb[i] += picture.rgb[i];
  }
  for (float& x : mean.rgb) x /= float(s.seeds);
  const Comparison c = compare(mean, expected, Mask(expected.width, expected.height), s.block);
  EXPECT_LT(c.max_mean_error(), s.mean_bound) << c.to_text();
  EXPECT_LT(c.block_rmse, s.block_bound) << c.to_text();
  std::printf("%s", c.to_text().c_str());
}

constexpr const char *figures = "scenes/subdivision/figures.pbrt", *staircase = "scenes/staircase2/scene-v4.pbrt",
                     *classroom = "scenes/classroom/scene-v4.pbrt";

// Seen: means within .8 and .5 %, blocks 1.2 and 2.0 %.
INSTANTIATE_TEST_SUITE_P(
    Quick, PresetScene,
    testing::Values(
        PresetCase{"figures_preview", figures, false, {"--resolution", "160x90"}, "128", "preview", 10, 1, 0.01, 0.02},
        PresetCase{
            "staircase2_preview", staircase, true, {"--resolution", "96x72"}, "512", "preview", 8, 8, 0.01, 0.04}),
    [](const auto& test) { return test.param.name; });

// Seen: means within .5, .2, .6 and .6 %, blocks .8, 1.0, 1.2 and 1.7 %. The wall is classroom's back wall, of which
// this reference is 1 % too dark, and where cells reach past window frames, skylight does.
INSTANTIATE_TEST_SUITE_P(
    Long, PresetScene,
    testing::Values(
        PresetCase{"figures_final", figures, false, {"--resolution", "160x90"}, "512", "final", 10, 1, 0.01, 0.015},
        PresetCase{"staircase2_final", staircase, true, {"--resolution", "96x72"}, "1024", "final", 8, 1, 0.01, 0.015},
        PresetCase{"classroom_final_wall",
                   classroom,
                   true,
                   {"--resolution", "320x180", "--crop", "80,60,128,108"},
                   "4096",
                   "final",
                   12,
                   1,
                   0.015,
                   0.02},
        PresetCase{"classroom_final", classroom, true, {"--resolution", "128x96"}, "8192", "final", 8, 3, 0.01, 0.03}),
    [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace dapple::test
