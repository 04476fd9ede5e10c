// SPDX-License-Identifier: Apache-2.0
// Rationale: uncached distribution ray tracing against the path tracer in scenes with textures, displacement, foliage and
// mixed materials. Expectation: means a channel and block averages (relative RMSE) within 3 %. Both sides take enough
// samples that noise is a third of that or less; each case says what was seen.
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
  double above_median = 6;  ///< pixels brighter than this many medians are left out: lamps, windows and what is lit as by fireflies
};

void PrintTo(const SceneCase& s, std::ostream* out) {
  *out << s.name;
}

class DistributionScene : public testing::TestWithParam<SceneCase> {};

TEST_P(DistributionScene, AgreesWithThePathTracer) {
  const SceneCase& s = GetParam();
  const std::string scene = s.shared ? shared_path(s.scene) : source_path(s.scene);
  if (!std::filesystem::exists(scene)) GTEST_SKIP() << "absent: " << scene;

  std::vector<std::string> path{"--integrator", "path", "--bounces", s.bounces, "--pixel-samples", s.path_samples, "--seed", "1"};
  std::vector<std::string> grids{"--integrator", "distribution", "--radiosity-cache", "off", "--bounces", s.bounces,
                                 "--pixel-samples", s.samples, "--shadow-rays", s.shadow_rays, "--diffuse-rays", s.diffuse_rays};
  for (auto* options : {&path, &grids}) options->insert(options->end(), s.view.begin(), s.view.end());
  const Picture expected = render(scene, path, 1200);
  const Picture picture = render(scene, grids, 1200);

  Mask mask(expected.width, expected.height);
  mask.leave_out_above_median(expected, s.above_median);
  mask.dilate(1);
  const Comparison c = compare(picture, expected, mask, s.block);
  EXPECT_LT(c.max_mean_error(), 0.03) << c.to_text();
  EXPECT_LT(c.block_rmse, 0.03) << c.to_text();
  std::printf("%s", c.to_text().c_str());
}

std::string name_of(const testing::TestParamInfo<SceneCase>& info) {
  return info.param.name;
}

}  // namespace
}  // namespace dapple::test
