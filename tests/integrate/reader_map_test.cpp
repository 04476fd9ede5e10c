// SPDX-License-Identifier: Apache-2.0
// How often a cell of the cache will be read, from a few paths before rendering.
#include "dapple/distribution/reader_map.h"

#include <gtest/gtest.h>

#include <cmath>

#include "dapple/base/hash.h"
#include "tests/support/cache_rooms.h"
#include "tests/support/render_text.h"

namespace dapple::distribution {
namespace {

constexpr V3f up{0, 0, 1};
constexpr ReadCell cell{.01f, .07f, .14f};

// 2000 readers of a floor of 2 x 2, three quarters of them on one half; each stands for 50.
TEST(ReaderMap, CountsRaysOfAnArea) {
  KeyedRng rng(3);
  std::vector<ReaderMap::Reader> readers;
  for (int i = 0; i < 2000; ++i) {
    const float x = (i % 4 == 0 ? -1 : 1) * rng.next(), y = 2 * rng.next() - 1;
    readers.push_back({V3f(x, y, 0), up});
  }
  ReaderMap map;
  map.add_depth(readers, std::vector<float>(readers.size(), .1f), 50, infinity);
  ASSERT_EQ(map.depths(), 1);
  double dense = 0, sparse = 0;
  for (int i = 0; i < 100; ++i) {
    const float x = .1f + .8f * rng.next(), y = 1.6f * rng.next() - .8f;
    dense += double(map.readers({V3f(x, y, 0), up}, 1, cell)) / 100;
    sparse += double(map.readers({V3f(-x, y, 0), up}, 1, cell)) / 100;
  }
  EXPECT_NEAR(dense, 1500 * 50 / 2.0 * .01, 1500 * 50 / 2.0 * .01 / 3);
  EXPECT_NEAR(sparse, 500 * 50 / 2.0 * .01, 500 * 50 / 2.0 * .01 / 3);
  EXPECT_LT(map.readers({V3f(.5f, 0, 0), -up}, 1, cell), dense) << "the other side";
  EXPECT_EQ(map.readers({V3f(.5f, 0, 0), up}, 2, cell), infinity);
}

// Cells of other widths have other readers, though they lie at the same place.
TEST(ReaderMap, CountsReadersOfACellByTheirWidth) {
  KeyedRng rng(4);
  std::vector<ReaderMap::Reader> readers;
  std::vector<float> widths;
  for (int i = 0; i < 4000; ++i) {
    readers.push_back({V3f(2 * rng.next() - 1, 2 * rng.next() - 1, 0), up});
    widths.push_back(i % 4 == 0 ? .1f : .4f);
  }
  ReaderMap map;
  map.add_depth(readers, widths, 10, infinity);
  double narrow = 0, wide = 0, all = 0, none = 0;
  for (int i = 0; i < 100; ++i) {
    const ReaderMap::Reader at{V3f(1.6f * rng.next() - .8f, 1.6f * rng.next() - .8f, 0), up};
    narrow += double(map.readers(at, 1, cell)) / 100;
    wide += double(map.readers(at, 1, {.04f, .28f, .57f})) / 100;
    all += double(map.readers(at, 1, {.01f, .05f, infinity})) / 100;
    none += double(map.readers(at, 1, {.01f, 1, infinity})) / 100;
  }
  EXPECT_NEAR(narrow, 10000 / 4.0 * .01, 10000 / 4.0 * .01 / 3);
  EXPECT_NEAR(wide, 30000 / 4.0 * .04, 30000 / 4.0 * .04 / 3);
  EXPECT_NEAR(all, 40000 / 4.0 * .01, 40000 / 4.0 * .01 / 3);
  EXPECT_EQ(none, 0);
}

// 10,000 readers a square metre ask for cells of .4 m, and 100 may share one.
TEST(ReaderMap, ManyReadersGetNarrowerCells) {
  KeyedRng rng(5);
  std::vector<ReaderMap::Reader> readers;
  for (int i = 0; i < 4000; ++i) readers.push_back({V3f(2 * rng.next() - 1, 2 * rng.next() - 1, 0), up});
  ReaderMap map;
  map.add_depth(readers, std::vector<float>(readers.size(), .4f), 10, 100);
  double widest = 0, narrow = 0, wide = 0;
  for (int i = 0; i < 100; ++i) {
    const ReaderMap::Reader at{V3f(1.6f * rng.next() - .8f, 1.6f * rng.next() - .8f, 0), up};
    widest += double(map.widest(at, 1)) / 100;
    narrow += double(map.readers(at, 1, {.01f, .05f, .2f})) / 100;
    wide += double(map.readers(at, 1, {.04f, .28f, .57f})) / 100;
  }
  EXPECT_NEAR(widest, .1, .015);
  EXPECT_NEAR(narrow, 100, 30);
  EXPECT_EQ(wide, 0);
  EXPECT_EQ(map.widest({V3f(0, 0, 0), up}, 2), infinity);
}

// Readers at one place, or a few, say nothing of how wide cells may be.
TEST(ReaderMap, FewReadersLimitNothing) {
  for (const size_t count : {1u, 5u}) {
    const std::vector<ReaderMap::Reader> readers(count, {V3f(.5f, .5f, 0), up});
    ReaderMap map;
    map.add_depth(readers, std::vector<float>(count, .1f), 50, 100);
    EXPECT_EQ(map.widest({V3f(.5f, .5f, 0), up}, 1), infinity);
    EXPECT_TRUE(std::isfinite(map.readers({V3f(.5f, .5f, 0), up}, 1, cell)));
  }
}

TEST(ReaderMap, WithoutReadersKnowsThatNobodyReads) {
  ReaderMap map;
  map.add_depth({}, {}, 10, 100);
  EXPECT_EQ(map.readers({V3f(0, 0, 0), up}, 1, {1, 0, infinity}), 0);
}

// The more samples, the more is read of each cell, and the more of it is cached.
TEST(ReaderMap, MoreSamplesFillMore) {
  const auto built = test::build_text(test::two_rooms(-1));
  const auto reads = [&](int samples) {
    DistributionIntegrator::Settings s;
    s.visible_points = VisiblePoints::samples;
    s.shading.bounces = 1;
    s.shading.shadow_rays = s.shading.diffuse_rays = {16, 4};
    double lookups = 0;
    for (const auto& c : test::render_built(built, samples, s).result.caches)
      if (c.name == "radiosity.depth1") lookups = double(c.counts.lookups);
    return lookups / samples;
  };
  EXPECT_GT(reads(64), 1.5 * reads(1));
}

}  // namespace
}  // namespace dapple::distribution
