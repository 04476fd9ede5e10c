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

// Its error is that of its resolution: it goes with the cells. What lights this plate is the floor around its own shadow.
TEST(RadiosityCache, ErrorFallsWithTheKnob) {
  const auto built = build_text(R"(Film "rgb" "integer xresolution" 32 "integer yresolution" 32
PixelFilter "box"
LookAt 0 0 .2  0 0 1  0 1 0
Camera "perspective" "float fov" 90
WorldBegin
LightSource "distant" "point3 from" [ .1 .2 1 ] "point3 to" [ 0 0 0 ] "rgb L" [ 3 3 3 ]
Material "diffuse" "rgb reflectance" [ .7 .7 .7 ]
Shape "bilinearmesh" "point3 P" [ -2 -2 0  2 -2 0  -2 2 0  2 2 0 ]
Shape "bilinearmesh" "point3 P" [ -.5 -.5 .5  -.5 .5 .5  .5 -.5 .5  .5 .5 .5 ]
)");
  auto exact = settings(1, false), rough = settings(1, true), fine = settings(1, true);
  rough.shading.cache_width = 8;
  fine.shading.cache_width = 0.125f;
  const float expected = render_built(built, 4, exact).mean().g;
  const auto error = [&](const DistributionIntegrator::Settings& s) { return std::abs(render_built(built, 4, s).mean().g / expected - 1); };
  EXPECT_LT(error(fine), 0.02f);
  EXPECT_GT(error(rough), 4 * error(fine));
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
