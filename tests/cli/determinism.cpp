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

struct Case {
  const char* scene;
  const char* integrator;
  const char* visible_points = "grids";
};

class AnyScene : public testing::TestWithParam<Case> {
 protected:
  void SetUp() override {
    scene_ = source_path(GetParam().scene);
    if (!std::filesystem::exists(scene_)) GTEST_SKIP() << "absent: " << scene_;
  }
  Picture render_with(std::vector<std::string> options) const {
    options.insert(options.end(),
                   {"--resolution", "96x64", "--pixel-samples", "7", "--float", "--integrator", GetParam().integrator});
    if (GetParam().integrator == std::string("distribution")) {
      options.insert(options.end(), {"--bounces", "2", "--shadow-rays", "1", "--diffuse-rays", "2"});
      options.insert(options.end(), {"--visible-points", GetParam().visible_points});
    }
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

// Numbers of rays that fill no batch and no packet evenly: which of a point's rays are traced together must not depend
// on the points beside it.
TEST(ManyRays, AreTheSameForAnyNumberOfThreadsAndAnyCache) {
  for (const char* interpolation : {"on", "off"}) {
    const auto render_with = [&](const char* threads, const char* cache_mb) {
      return render(source_path("scenes/cornell-box/cornell.pbrt"),
                    {"--integrator", "distribution", "--resolution", "40x40", "--pixel-samples", "3", "--float",
                     "--bounces", "2", "--shadow-rays", "40,20", "--diffuse-rays", "100,17",
                     "--irradiance-interpolation", interpolation, "--threads", threads, "--cache-mb", cache_mb});
    };
    const Picture one = render_with("1", "100");
    EXPECT_TRUE(same_bits(one, render_with("2", "0.2"))) << interpolation;
    EXPECT_TRUE(same_bits(one, render_with("4", "1"))) << interpolation;
  }
}

constexpr const char* cornell = "scenes/cornell-box/cornell.pbrt";
constexpr const char* plates = "../shared/scenes/veach-mis/scene-v4.pbrt";
constexpr const char* stairs = "../shared/scenes/staircase2/scene-v4.pbrt";
constexpr const char* leaves = "../shared/scenes/forest/forest-cutout.pbrt";
constexpr const char* crowns = "../shared/scenes/forest/forest-above.pbrt";
INSTANTIATE_TEST_SUITE_P(Scenes, AnyScene,
                         testing::Values(Case{cornell, "path"}, Case{plates, "path"}, Case{stairs, "path"},
                                         Case{leaves, "path"}, Case{cornell, "distribution"},
                                         Case{stairs, "distribution"}, Case{leaves, "distribution"},
                                         Case{crowns, "distribution"}, Case{stairs, "distribution", "samples"},
                                         Case{leaves, "distribution", "samples"}, Case{cornell, "ao"},
                                         Case{leaves, "canopy"}),
                         [](const auto& test) { return "scene_" + std::to_string(test.index); });

}  // namespace
}  // namespace dapple::test
