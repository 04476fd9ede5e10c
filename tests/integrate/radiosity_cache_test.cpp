// SPDX-License-Identifier: Apache-2.0
// The radiosity cache in whole renders: right, pure, reused, and within its memory.
#include <gtest/gtest.h>

#include <list>

#include "dapple/base/parallel.h"
#include "tests/support/cache_rooms.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using distribution::DistributionIntegrator;
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

// Its error is that of its resolution: it goes with the cells. What lights this plate is the floor around its own
// shadow.
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
  const auto error = [&](const DistributionIntegrator::Settings& s) {
    return std::abs(render_built(built, 4, s).mean().g / expected - 1);
  };
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

// A closed room full of boxes, seen with small cells: every visible point reads cells of the whole room.
std::string crowded_room() {
  std::string text = R"(Film "rgb" "integer xresolution" 32 "integer yresolution" 32
PixelFilter "box"
LookAt 0 -1.9 1  0 0 .5  0 0 1
Camera "perspective" "float fov" 70
WorldBegin
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 6 6 6 ]
  Shape "bilinearmesh" "point3 P" [ -.8 -.8 1.99  -.8 .8 1.99  .8 -.8 1.99  .8 .8 1.99 ]
AttributeEnd
Material "diffuse" "rgb reflectance" [ .6 .5 .4 ]
)";
  const auto box = [](const V3f& a, const V3f& b) {
    const auto p = [&](int corner) {
      return V3f((corner & 1) ? b.x : a.x, (corner & 2) ? b.y : a.y, (corner & 4) ? b.z : a.z);
    };
    std::string faces;
    for (const auto& f : {std::array{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 4, 5}, {2, 3, 6, 7}, {0, 2, 4, 6}, {1, 3, 5, 7}})
      faces += test::wall(p(f[0]), p(f[1]), p(f[2]), p(f[3]));
    return faces;
  };
  text += box({-2, -2, 0}, {2, 2, 2});
  for (int i = 0; i < 25; ++i) {
    const V3f at(-1.6f + 0.75f * float(i % 5), -1 + 0.6f * float(i / 5), 0);
    text += box(at, at + V3f(0.3f, 0.3f, 0.25f + 0.02f * float(i)));
  }
  return text;
}

// When all points of a tile were computed at once, it was 5.5 and 49 times the points.
TEST(RadiosityCache, SmallOneDoesNotCollapse) {
  const auto built = build_text(crowded_room());
  auto s = settings(2, true);
  s.shading.shadow_rays = RayList{2, 1};
  s.shading.diffuse_rays = RayList{16, 4};
  s.shading.cache_width = 0.03f;
  set_thread_count(1);
  s.cache_bytes = size_t(1) << 26;
  const auto whole = render_built(built, 2, s);
  uint64_t all = 0;
  for (const integrate::CacheState& c : whole.result.caches)
    if (c.has_memory && c.name != "grids") all += c.bytes;
  const auto shaded = [](const auto& r) { return double(r.result.stages[shading::Stage::diffuselighting]); };
  for (const auto& [part, most] : {std::pair{4, 4.0}, {20, 16.0}}) {
    s.cache_bytes = all / uint64_t(part);
    const auto other = render_built(built, 2, s);
    EXPECT_TRUE(same_bits(whole.film, other.film)) << part;
    EXPECT_LT(shaded(other) / shaded(whole), most) << "1/" << part << " of " << all;
  }
  set_thread_count(0);
}

// An entry grows by the points that look-ups want.
TEST(RadiosityCache, EntriesAreFilledPointByPoint) {
  using Found = gi::TileCache::Found;
  constexpr int groups = 2;
  gi::RadiosityCache cache(1 << 20, groups);
  gi::RadiosityCache::Counts counts;
  counts.by_depth.resize(2);
  std::list<std::vector<uint32_t>> memory;
  const auto entry = [&](uint32_t needed) {
    gi::RadiosityCache::Entry e;
    e.groups = groups;
    e.words = memory.emplace_back(gi::RadiosityCache::words(gi::RadiosityCache::max_points, groups)).data();
    e.grid.u_level = e.grid.v_level = 5;
    e.key = gi::RadiosityCache::key(e.grid.hash(), 1);
    e.needed = needed;
    cache.find(e, &counts);
    return e;
  };
  // A value v of which group 0 gave a quarter.
  const auto set = [](gi::RadiosityCache::Entry& e, int point, float v) {
    const RGB parts[groups] = {RGB(v / 4), RGB(v * 3 / 4)};
    e.set(point, {RGB(v), parts});
  };
  auto first = entry(0b0011);
  ASSERT_EQ(first.found, Found::mine);
  EXPECT_EQ(first.missing(), 0b0011u);
  first.set_links({0b0001, 0b0010});
  set(first, 0, 1), set(first, 1, 2);
  auto waiting = entry(0b0010), in_vain = entry(0b0100);
  EXPECT_EQ(waiting.found, Found::pending);
  cache.publish(first);
  EXPECT_TRUE(cache.wait(waiting));
  EXPECT_FALSE(cache.wait(in_vain));
  EXPECT_EQ(entry(0b0010).found, Found::ready);

  auto second = entry(0b1001);
  ASSERT_EQ(second.found, Found::mine);
  EXPECT_EQ(second.missing(), 0b1000u);
  EXPECT_EQ(second.links().divided, 0b0001u);
  second.set_links({0b1001, 0b0010});
  set(second, 3, 4);
  cache.publish(second);
  const auto third = entry(0b1011);
  ASSERT_EQ(third.found, Found::ready);
  EXPECT_EQ(third.links().divided, 0b1001u);
  EXPECT_EQ(third.links().cut, 0b0010u);
  integrate::LightSums sums(groups);
  for (const auto& [point, value] : {std::pair{0, 1.0f}, {1, 2.0f}, {3, 4.0f}}) {
    sums.clear(point);
    third.add_to(sums, point, point, 0.5f);
    EXPECT_EQ(sums[point], RGB(value / 2));
    EXPECT_EQ(sums.parts(point)[0], RGB(value / 8));
    EXPECT_EQ(sums.parts(point)[1], RGB(value * 3 / 8));
  }
  EXPECT_EQ(counts.by_depth[1].bytes, int64_t(cache.state(integrate::Resolution::fine).bytes)) << "one entry";
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
