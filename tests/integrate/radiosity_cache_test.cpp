// SPDX-License-Identifier: Apache-2.0
// The radiosity cache in whole renders: right, pure, reused, and within its memory.
#include <gtest/gtest.h>

#include "dapple/base/parallel.h"
#include "tests/support/cache_rooms.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using integrate::DistributionIntegrator;
using integrate::RayList;
using test::build_text;
using test::expect_near;
using test::render_built;
using test::room;
using test::same_bits;
using test::two_rooms;

DistributionIntegrator::Settings settings(int bounces, bool cache) {
  DistributionIntegrator::Settings s;
  s.shading.bounces = bounces;
  s.shading.shadow_rays = RayList{4, 2};
  s.shading.diffuse_rays = RayList{32, 8};
  s.radiosity_cache = cache;
  return s;
}

// Inside a uniform sphere all values are equal, whatever the resolution: what is left is the rounding of entries.
TEST(RadiosityCache, FurnaceIsExact) {
  const auto built = build_text(R"(Film "rgb" "integer xresolution" 16 "integer yresolution" 16
PixelFilter "box"
Camera "spherical" "string mapping" "equirectangular"
WorldBegin
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
AreaLightSource "diffuse" "rgb L" [ 1 1 1 ]
ReverseOrientation
Shape "sphere" "float radius" 2
)");
  auto s = settings(3, true);
  s.shading.shadow_rays = RayList{16};
  expect_near(render_built(built, 4, s).mean(), RGB(1 + .5f + .25f + .125f + .0625f), 0.004f, "furnace");
}

TEST(RadiosityCache, AgreesWithThePathTracerInARoomThatBreaksCaches) {
  const auto built = build_text(room);
  const RGB expected = render_built(built, 1024, test::bounces(2, 8)).mean();
  expect_near(render_built(built, 16, settings(2, true)).mean(), expected, 0.02f, "room");
}

TEST(RadiosityCache, DoesNotLeakThroughAWall) {
  auto s = settings(2, true);
  s.shading.diffuse_rays = RayList{16, 4};  // wide cells
  const auto lit = build_text(two_rooms(-1)), dark = build_text(two_rooms(1));
  const RGB expected = render_built(lit, 256, test::bounces(2, 8)).mean(), there = render_built(lit, 8, s).mean();
  expect_near(there, expected, 0.02f, "lit room");
  EXPECT_LT(render_built(dark, 8, s).mean().luminance(), 1e-4f * there.luminance());
}

// Its error is that of its resolution: it goes with the cells.
TEST(RadiosityCache, ErrorFallsWithTheKnob) {
  const auto built = build_text(room);
  auto exact = settings(1, false), rough = settings(1, true), fine = settings(1, true);
  rough.shading.cache_width = 4;
  fine.shading.cache_width = 0.125f;
  const RGB expected = render_built(built, 4, exact).mean();
  const auto error = [&](const DistributionIntegrator::Settings& s) {
    const RGB mean = render_built(built, 4, s).mean();
    return std::max({std::abs(mean.r / expected.r - 1), std::abs(mean.g / expected.g - 1), std::abs(mean.b / expected.b - 1)});
  };
  EXPECT_LT(error(fine), 0.004f);
  EXPECT_GT(error(rough), 2 * error(fine));
}

TEST(RadiosityCache, SavesShading) {
  const auto built = build_text(room);
  const auto with = render_built(built, 4, settings(2, true)), without = render_built(built, 4, settings(2, false));
  EXPECT_LT(10 * with.result.stages[shading::Stage::prelighting], without.result.stages[shading::Stage::prelighting]);
  ASSERT_EQ(with.result.caches.size(), 6u);
  uint64_t by_resolution = 0, by_depth = 0;
  for (const integrate::CacheState& c : with.result.caches) {
    if (c.name == "grids") continue;
    EXPECT_EQ(c.counts.lookups, c.counts.hits + c.counts.fills) << c.name;
    EXPECT_GT(c.counts.hits, c.counts.fills) << c.name;
    EXPECT_LE(c.bytes, c.capacity_bytes);
    (c.has_memory ? by_resolution : by_depth) += c.counts.lookups;
  }
  EXPECT_EQ(by_resolution, by_depth);
}

TEST(RadiosityCache, OfAnyMemoryAndThreadsGivesTheSameImage) {
  const auto built = build_text(room);
  auto s = settings(2, true);
  s.shading.diffuse_rays = RayList{9, 3};  // do not divide a batch: points straddle two
  const auto whole = render_built(built, 2, s);
  for (const size_t bytes : {size_t(0), size_t(20000), size_t(1) << 30}) {
    s.cache_bytes = bytes;
    for (const int threads : {1, 4}) {
      set_thread_count(threads);
      const auto other = render_built(built, 2, s);
      EXPECT_TRUE(same_bits(whole.film, other.film)) << bytes << " bytes, " << threads << " threads";
      uint64_t capacity = 0;
      for (const integrate::CacheState& c : other.result.caches)
        if (c.name != "grids") capacity += c.capacity_bytes;
      EXPECT_LE(capacity, bytes);
    }
  }
  set_thread_count(0);
}

}  // namespace
}  // namespace dapple
