// SPDX-License-Identifier: Apache-2.0
// Rationale: scenes made by others, held against other renderers. The scenes and references lie beside the repository
// and are too large for it; where they are absent these tests are skipped and say so. Expectation, as the references'
// page states it for a right RGB renderer against spectral pbrt-v4, pixels above 6 times the median left out: means
// within 3 % in red and green and 8 % in blue, 5x5 block averages (at the references' resolution) within 6 %.
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/dapple_program.h"

namespace dapple::test {
namespace {

struct SceneCase {
  const char* name;
  const char* scene;
  const char* reference;
  int samples;
  int block = 5;
  double max_red_green = 0.03, max_blue = 0.08, max_block = 0.06;
};

void PrintTo(const SceneCase& s, std::ostream* out) {
  *out << s.name;
}

class SharedScene : public testing::TestWithParam<SceneCase> {};

TEST_P(SharedScene, AgreesWithReference) {
  const SceneCase& s = GetParam();
  const std::string scene = shared_path(s.scene), reference_file = shared_path(s.reference);
  for (const std::string& file : {scene, reference_file})
    if (!std::filesystem::exists(file)) GTEST_SKIP() << "absent: " << file;

  const Picture reference = load_picture(reference_file);
  const std::string resolution = std::to_string(reference.width) + "x" + std::to_string(reference.height);
  const Picture picture =
      render(scene, {"--resolution", resolution, "--pixel-samples", std::to_string(s.samples), "--seed", "1"}, 1200);

  Mask mask(reference.width, reference.height);
  mask.leave_out_above_median(reference, 6);
  // Whether a seed meets caustics that paths find once in a million is chance.
  const size_t compared = mask.count();
  mask.leave_out_above_median(picture, 6);
  EXPECT_GT(double(mask.count()), 0.99 * double(compared));
  const Comparison c = compare(picture, reference, mask, s.block);
  EXPECT_LT(std::abs(c.mean_error[0]), s.max_red_green);
  EXPECT_LT(std::abs(c.mean_error[1]), s.max_red_green);
  EXPECT_LT(std::abs(c.mean_error[2]), s.max_blue);
  EXPECT_LT(c.block_rmse, s.max_block);
  std::printf("%s", c.to_text().c_str());
  if (HasFailure()) {
    const std::string difference = std::string(s.name) + "-difference.png";
    write_difference(difference, picture, reference, mask, 0.5);
    std::printf("difference: %s\n", std::filesystem::absolute(difference).c_str());
  }
}

std::string name_of(const testing::TestParamInfo<SceneCase>& info) {
  return info.param.name;
}

INSTANTIATE_TEST_SUITE_P(
    Quick, SharedScene,
    testing::Values(
        SceneCase{"veach_mis", "scenes/veach-mis/scene-v4.pbrt", "reference/pbrt-v4/veach-mis.exr", 256},
        // In blue the reference is 8.7 % below RGB renderers here (Tungsten too): the red and green walls' spectra.
        SceneCase{"cornell_box", "scenes/cornell-box/scene-v4.pbrt", "reference/pbrt-v4/cornell-box.exr", 256, 5, 0.03,
                  0.1}),
    name_of);

INSTANTIATE_TEST_SUITE_P(
    Long, SharedScene,
    testing::Values(
        SceneCase{"cornell_box_tungsten", "scenes/cornell-box/scene-v4.pbrt", "scenes/cornell-box/TungstenRender.exr",
                  16, 40, 0.01, 0.01, 0.02},
        SceneCase{"staircase2", "scenes/staircase2/scene-v4.pbrt", "reference/pbrt-v4/staircase2.exr", 512},
        SceneCase{"staircase2_tungsten", "scenes/staircase2/scene-v4.pbrt", "scenes/staircase2/TungstenRender.exr", 16,
                  40},
        SceneCase{"classroom", "scenes/classroom/scene-v4.pbrt", "reference/pbrt-v4/classroom.exr", 4096},
        SceneCase{"tree", "scenes/forest/tree.pbrt", "reference/pbrt-v4/tree.exr", 128},
        SceneCase{"forest_cutout", "scenes/forest/forest-cutout.pbrt", "reference/pbrt-v4/forest-cutout.exr", 128},
        SceneCase{"forest_inside", "scenes/forest/forest-inside.pbrt", "reference/pbrt-v4/forest-inside.exr", 512},
        SceneCase{"forest_above", "scenes/forest/forest-above.pbrt", "reference/pbrt-v4/forest-above.exr", 128}),
    name_of);

}  // namespace
}  // namespace dapple::test
