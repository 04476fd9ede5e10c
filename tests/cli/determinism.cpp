// SPDX-License-Identifier: Apache-2.0
// DESIGN promise 3: the same image, bit for bit, for any number of threads; and what a crop shows is what the whole
// image shows there.
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>

#include "tests/support/dapple_program.h"

namespace dapple::test {
namespace {

bool same_bits(const Picture& a, const Picture& b) {
  return a.width == b.width && a.height == b.height &&
         std::memcmp(a.rgb.data(), b.rgb.data(), a.rgb.size() * sizeof(float)) == 0;
}

class AnyScene : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    scene_ = source_path(GetParam());
    if (!std::filesystem::exists(scene_)) GTEST_SKIP() << "absent: " << scene_;
  }
  Picture render_with(std::vector<std::string> options) const {
    options.insert(options.end(), {"--resolution", "96x64", "--pixel-samples", "7", "--float"});
    return render(scene_, options);
  }
  std::string scene_;
};

TEST_P(AnyScene, IsTheSameForAnyNumberOfThreads) {
  const Picture one = render_with({"--threads", "1"});
  EXPECT_TRUE(same_bits(one, render_with({"--threads", "2"})));
  EXPECT_TRUE(same_bits(one, render_with({"--threads", "4"})));
}

TEST_P(AnyScene, DependsOnTheSeed) {
  const Picture first = render_with({"--seed", "1"});
  EXPECT_TRUE(same_bits(first, render_with({"--seed", "1"})));
  EXPECT_FALSE(same_bits(first, render_with({"--seed", "2"})));
}

TEST_P(AnyScene, CropShowsThatPartOfTheWhole) {
  const Picture whole = render_with({});
  EXPECT_TRUE(same_bits(crop(whole, 21, 13, 60, 50), render_with({"--crop", "21,13,60,50"})));
}

INSTANTIATE_TEST_SUITE_P(Scenes, AnyScene,
                         testing::Values("scenes/cornell-box/cornell.pbrt", "../shared/scenes/veach-mis/scene-v4.pbrt",
                                         "../shared/scenes/staircase2/scene-v4.pbrt",
                                         "../shared/scenes/forest/forest-cutout.pbrt"),
                         [](const auto& test) { return "scene_" + std::to_string(test.index); });

}  // namespace
}  // namespace dapple::test
