// SPDX-License-Identifier: Apache-2.0
// Images of trees against rays.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "dapple/base/parallel.h"
#include "dapple/depthimage/object_picture.h"
#include "dapple/impostor/object_baker.h"
#include "dapple/numeric/sobol.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using depthimage::ObjectPicture;
using depthimage::Shown;
using depthimage::SplatObject;
using test::build_text;

const std::filesystem::path forest = std::filesystem::path(DAPPLE_SHARED_DIR) / "scenes/forest";

std::string tree_scene(const std::string& tree) {
  const std::string folder = forest.string() + "/";
  return R"(Camera "perspective" WorldBegin
ObjectBegin "tree"
  Material "diffuse" "rgb reflectance" [ .15 .12 .09 ]
  Shape "plymesh" "string filename" ")" +
         folder + tree + R"(_bark.ply"
  Material "diffusetransmission" "rgb reflectance" [ .05 .11 .04 ] "rgb transmittance" [ .04 .1 .02 ]
  Shape "plymesh" "string filename" ")" +
         folder + tree + R"(_leaf.ply"
ObjectEnd
ObjectInstance "tree")";
}

/// Cover as rays see it, 16 a pixel.
std::vector<float> traced_cover(const scene::Scene& scene, const V3f& to_viewer, const SplatObject& object,
                                int pixels) {
  const V3f up = std::abs(to_viewer.z) > 0.999f ? V3f(0, 1, 0) : V3f(0, 0, 1);
  const V3f right = normalize(cross(up, to_viewer)), over = cross(to_viewer, right);
  const float step = length(object.box.max - object.box.min) / float(pixels);
  std::vector<float> cover(size_t(pixels) * size_t(pixels));
  parallel_for(size_t(pixels), [&](size_t y) {
    trace::RayBatch rays{};
    trace::HitBatch hits;
    for (int x = 0; x < pixels; ++x) {
      for (uint32_t i = 0; i < 16; ++i) {
        const V2f u = sample_2d(1, uint32_t(y) * 65536u + uint32_t(x) * 16 + i, 0);
        const float a = (float(x) + u.x - 0.5f * float(pixels)) * step,
                    b = (0.5f * float(pixels) - float(y) - u.y) * step;
        rays.set(int(i), object.centre + right * a + over * b + to_viewer * (4 * object.radius), -to_viewer, infinity,
                 0.5f, i);
      }
      scene.traced.intersect(rays, 16, &hits);
      for (int i = 0; i < 16; ++i)
        cover[y * size_t(pixels) + size_t(x)] += hits.geometry[i] == trace::no_id ? 0 : 1.0f / 16;
    }
  });
  return cover;
}

struct Errors {
  double mean = 0, blocks = 0;  // of cover, over blocks of 8 x 8 pixels that are not empty: mean, root mean square
};

Errors compare(const std::vector<float>& a, const std::vector<float>& b, int pixels) {
  Errors e;
  int count = 0;
  for (int y = 0; y + 8 <= pixels; y += 8)
    for (int x = 0; x + 8 <= pixels; x += 8) {
      double sum = 0, reference = 0;
      for (int i = 0; i < 64; ++i) {
        const size_t p = size_t(y + i / 8) * size_t(pixels) + size_t(x + i % 8);
        sum += double(a[p]), reference += double(b[p]);
      }
      if (reference == 0 && sum == 0) continue;
      e.mean += (sum - reference) / 64;
      e.blocks += (sum - reference) * (sum - reference) / (64 * 64);
      ++count;
    }
  e.mean /= count;
  e.blocks = std::sqrt(e.blocks / count);
  return e;
}

class Trees : public testing::TestWithParam<std::tuple<const char*, int>> {
 public:
  void SetUp() override {
    if (!std::filesystem::exists(forest)) GTEST_SKIP() << forest << " is absent";
  }
};

class FarTrees : public testing::TestWithParam<const char*> {
 public:
  void SetUp() override {
    if (!std::filesystem::exists(forest)) GTEST_SKIP() << forest << " is absent";
  }
};

// Rationale: images stand for trees if they cover what trees cover. Expectation, from random directions, a texel a
// pixel: cover within .01 in the mean, and within .03 in blocks of 8 x 8 pixels (root mean square), by each level.
TEST_P(Trees, CoverWhatTreesCover) {
  const auto [tree, resolution] = GetParam();
  const build::BuiltScene built = build_text(tree_scene(tree));
  const SplatObject object(impostor::ObjectBaker(*built.scene, {.resolution = resolution}).bake(0, tree));
  KeyedRng rng(1);
  Errors sum;
  const char* const wanted = std::getenv("DAPPLE_TEST_VIEWS");
  const int views = wanted ? std::atoi(wanted) : 8;
  ASSERT_GE(views, 1);
  for (int i = 0; i < views; ++i) {
    const float z = 2 * rng.next() - 1, phi = 2 * pi * rng.next();
    const V3f to_viewer(std::sqrt(1 - z * z) * std::cos(phi), std::sqrt(1 - z * z) * std::sin(phi), z);
    const int pixels = int(float(resolution) * length(object.box.max - object.box.min) / (2 * object.radius));
    const ObjectPicture picture = depthimage::project(
        object, 0, depthimage::orthographic_map(object, to_viewer, pixels), {pixels, pixels}, Shown::color);
    const Errors e = compare(picture.alpha, traced_cover(*built.scene, to_viewer, object, pixels), pixels);
    sum.mean += e.mean / views, sum.blocks += e.blocks / views;
  }
  std::printf("%s, %d texels, %d views: mean %+.4f, blocks %.4f\n", tree, resolution, views, sum.mean, sum.blocks);
  EXPECT_LE(std::abs(sum.mean), 0.01);
  EXPECT_LE(sum.blocks, 0.03);
}

// Rationale: the coarsest levels stand for most trees of a large forest, and have few samples: 16 x 16 lines an image
// at 4 texels. Expectation: the levels end there, and in the mean over 32 views they cover as much as the tree, to
// 10 %: leaves that hide each other are parted where samples are metres apart.
TEST_P(FarTrees, CoverInAllWhatTreesCover) {
  const char* const tree = GetParam();
  const build::BuiltScene built = build_text(tree_scene(tree));
  const SplatObject object(impostor::ObjectBaker(*built.scene, {.resolution = 16}).bake(0, tree));
  ASSERT_EQ(object.levels.size(), 3u);
  EXPECT_NEAR(object.levels.back().texel, 2 * object.radius / 4, 1e-4f * object.radius);
  constexpr int pixels = 64, views = 32;
  KeyedRng rng(3);
  double covered = 0, of_level[3] = {};
  for (int i = 0; i < views; ++i) {
    const float z = 2 * rng.next() - 1, phi = 2 * pi * rng.next();
    const V3f to_viewer(std::sqrt(1 - z * z) * std::cos(phi), std::sqrt(1 - z * z) * std::sin(phi), z);
    for (const float c : traced_cover(*built.scene, to_viewer, object, pixels)) covered += double(c);
    for (int level = 0; level < 3; ++level) {
      const auto map = depthimage::orthographic_map(object, to_viewer, pixels);
      for (const float a : depthimage::project(object, level, map, {pixels, pixels}, Shown::color).alpha)
        of_level[level] += double(a);
    }
  }
  std::printf("%s, levels of 16, 8 and 4 texels: %+.4f, %+.4f, %+.4f of the cover\n", tree, of_level[0] / covered - 1,
              of_level[1] / covered - 1, of_level[2] / covered - 1);
  for (const double cover : of_level) EXPECT_NEAR(cover / covered, 1, 0.1);
}

// Rationale: layers are kept so that nothing is missing from elsewhere. Expectation: of the pixels in the midst of what
// rays find opaque, one of a thousand at most has a gap; with one layer, each of six images keeping what it sees first,
// ten times as many.
TEST(Trunks, HaveNoHolesButWithOneLayer) {
  if (!std::filesystem::exists(forest)) GTEST_SKIP() << forest << " is absent";
  std::string bark = tree_scene("small_maple");
  bark.erase(bark.find("  Material \"diffusetransmission\""),
             bark.find("ObjectEnd") - bark.find("  Material \"diffusetransmission\""));
  const build::BuiltScene built = build_text(bark);
  const SplatObject all(impostor::ObjectBaker(*built.scene, {.resolution = 256}).bake(0, "bark"));
  const SplatObject one(impostor::ObjectBaker(*built.scene, {.resolution = 256, .layers = 1}).bake(0, "bark"));
  int inside = 0, holes = 0, holes_of_one = 0;
  KeyedRng rng(2);
  for (int i = 0; i < 6; ++i) {
    const float z = 0.3f * (2 * rng.next() - 1), phi = 2 * pi * rng.next();
    const V3f to_viewer(std::sqrt(1 - z * z) * std::cos(phi), std::sqrt(1 - z * z) * std::sin(phi), z);
    const int pixels = int(256 * length(all.box.max - all.box.min) / (2 * all.radius));
    const auto map = depthimage::orthographic_map(all, to_viewer, pixels);
    const auto picture = depthimage::project(all, 0, map, {pixels, pixels}, Shown::color),
               poor = depthimage::project(one, 0, map, {pixels, pixels}, Shown::color);
    const std::vector<float> cover = traced_cover(*built.scene, to_viewer, all, pixels);
    for (int y = 1; y + 1 < pixels; ++y)
      for (int x = 1; x + 1 < pixels; ++x) {
        float least = 1;
        for (int k = 0; k < 9; ++k)
          least = std::min(least, cover[size_t(y + k / 3 - 1) * size_t(pixels) + size_t(x + k % 3 - 1)]);
        if (least < 1) continue;
        const size_t pixel = size_t(y) * size_t(pixels) + size_t(x);
        ++inside;
        holes += picture.alpha[pixel] < 1, holes_of_one += poor.alpha[pixel] < 1;
      }
  }
  std::printf("%d pixels, %d with gaps, %d with one layer\n", inside, holes, holes_of_one);
  EXPECT_GT(inside, 2000);
  EXPECT_LE(holes, inside / 1000);
  EXPECT_GE(holes_of_one, 10 * std::max(1, holes));
}

INSTANTIATE_TEST_SUITE_P(Species, FarTrees, testing::Values("quaking_aspen", "small_maple"),
                         [](const auto& p) { return std::string(p.param); });

INSTANTIATE_TEST_SUITE_P(Levels, Trees,
                         testing::Combine(testing::Values("quaking_aspen", "small_maple"),
                                          testing::Values(16, 32, 64, 128, 256)),
                         [](const auto& p) {
                           return std::string(std::get<0>(p.param)) + "_" + std::to_string(std::get<1>(p.param));
                         });

}  // namespace
}  // namespace dapple
