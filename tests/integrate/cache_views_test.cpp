// SPDX-License-Identifier: Apache-2.0
// Pictures of the radiosity cache, and its statistics by depth, say what it did.
#include <gtest/gtest.h>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"
#include "dapple/gi/cache_log.h"
#include "tests/support/cache_rooms.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using distribution::DistributionIntegrator;
using gi::CacheLog;
using integrate::CacheState;
using integrate::RayList;
using test::build_text;
using test::room;
using test::same_bits;

DistributionIntegrator::Settings settings(size_t cache_bytes) {
  DistributionIntegrator::Settings s;
  s.shading.bounces = 2;
  s.shading.shadow_rays = RayList{4, 2};
  s.shading.diffuse_rays = RayList{9, 3};
  s.pixel_samples = 2;
  s.cache_bytes = cache_bytes;
  s.log_caches = true;
  return s;
}

test::RenderedText render_views(const build::BuiltScene& built, const DistributionIntegrator::Settings& s) {
  scene::Film::Settings film = built.scene->film;
  film.cache_use = true;
  test::RenderedText r{scene::Film(film), {}};
  render::StopRules rules;
  rules.pixel_samples = uint32_t(s.pixel_samples);
  const std::atomic<bool> interrupt{false};
  r.result = render::RenderSession(DistributionIntegrator(*built.scene, s), r.film, rules).run(interrupt);
  return r;
}

template <class Visit>
void for_each_pixel(const scene::Film& film, const Visit& visit) {
  for (int y = 0; y < film.height(); ++y)
    for (int x = 0; x < film.width(); ++x) visit(x, y, film.cache_features(x, y));
}

TEST(CacheViews, LevelsAreTheSameForAnyMemoryAndThreads) {
  const auto built = build_text(room);
  const auto whole = render_views(built, settings(size_t(100) << 20));
  for (const size_t bytes : {size_t(0), size_t(20000)})
    for (const int threads : {1, 4}) {
      set_thread_count(threads);
      const auto other = render_views(built, settings(bytes));
      for_each_pixel(whole.film, [&](int x, int y, const scene::CacheFeatures& use) {
        const scene::CacheFeatures o = other.film.cache_features(x, y);
        EXPECT_EQ(std::tie(use.coarse, use.medium, use.fine, use.shaded),
                  std::tie(o.coarse, o.medium, o.fine, o.shaded))
            << x << ", " << y;
      });
    }
  set_thread_count(0);
}

TEST(CacheViews, AreOfTheSameImage) {
  const auto built = build_text(room);
  auto plain = settings(size_t(100) << 20);
  plain.log_caches = false;
  EXPECT_TRUE(
      same_bits(render_views(built, settings(size_t(100) << 20)).film, test::render_built(built, 2, plain).film));
}

// In a closed sphere every diffuse ray meets what the cache serves, at the middle of nothing else.
TEST(CacheViews, SharesAreOfAllRays) {
  const auto built = build_text(R"(Film "rgb" "integer xresolution" 16 "integer yresolution" 16
Camera "spherical" "string mapping" "equirectangular"
WorldBegin
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
AreaLightSource "diffuse" "rgb L" [ 1 1 1 ]
ReverseOrientation
Shape "sphere" "float radius" 2
)");
  for_each_pixel(render_views(built, settings(size_t(100) << 20)).film,
                 [](int x, int y, const scene::CacheFeatures& use) {
                   EXPECT_NEAR(use.coarse + use.medium + use.fine, 1, 1e-5) << x << ", " << y;
                   EXPECT_EQ(use.shaded, 0);
                 });
}

// The picture sends the rays of the rendering again: all that they read was read before.
TEST(CacheViews, KnowWhatWasRead) {
  const auto built = build_text(room);
  const auto much = render_views(built, settings(size_t(100) << 20)), little = render_views(built, settings(20000)),
             none = render_views(built, settings(0));
  double fills[2] = {}, reuse[2] = {};
  for_each_pixel(much.film, [&](int x, int y, const scene::CacheFeatures& use) {
    const scene::CacheFeatures less = little.film.cache_features(x, y), nothing = none.film.cache_features(x, y);
    if (use.coarse + use.medium + use.fine == 0) return;
    EXPECT_EQ(use.fills, 1) << x << ", " << y;
    EXPECT_GE(use.reuse, 1) << x << ", " << y;
    EXPECT_TRUE(use.age >= 0 && use.age <= 1) << use.age;
    EXPECT_GE(less.fills, 1) << x << ", " << y;
    EXPECT_EQ(nothing.reuse, 1) << x << ", " << y;
    EXPECT_GE(nothing.fills, 1) << x << ", " << y;
    fills[0] += double(less.fills), fills[1] += double(nothing.fills);
    reuse[0] += double(use.reuse), reuse[1] += double(less.reuse);
  });
  EXPECT_GT(fills[1], fills[0]);
  EXPECT_GT(reuse[0], 2 * reuse[1]);
}

TEST(CacheStatistics, ByDepthAddUpToThoseByResolution) {
  const auto built = build_text(room);
  const auto little = render_views(built, settings(20000));
  uint64_t evictions[2] = {}, bytes[2] = {}, lookups[2] = {}, fills[2] = {};
  for (const CacheState& c : little.result.caches) {
    if (!c.name.starts_with("radiosity.")) continue;
    const bool by_depth = !c.has_memory;
    EXPECT_GT(c.counts.lookups, 0u) << c.name;
    lookups[by_depth] += c.counts.lookups, fills[by_depth] += c.counts.fills;
    evictions[by_depth] += by_depth ? c.counts.evictions : c.evictions;
    bytes[by_depth] += by_depth ? uint64_t(c.counts.bytes) : c.bytes;
  }
  EXPECT_EQ(lookups[0], lookups[1]);
  EXPECT_EQ(fills[0], fills[1]);
  EXPECT_GT(evictions[0], 100u);
  EXPECT_EQ(evictions[0], evictions[1]);
  EXPECT_GT(bytes[0], 1000u);
  EXPECT_EQ(bytes[0], bytes[1]);
}

TEST(CacheLog, OfTooManyEntriesIsAFairSample) {
  const Timer clock;
  CacheLog small(clock, 100), whole(clock), other(clock, 50);
  const auto key = [](uint64_t i) { return hash(i); };
  for (uint64_t i = 0; i < 10000; ++i)
    for (uint64_t n = 0; n <= i % 3; ++n)
      for (CacheLog* log : {&small, &whole}) log->add(key(i), n == 0, double(i));
  for (uint64_t i = 5000; i < 6000; ++i) other.add(key(i), true, 1e6);
  EXPECT_EQ(whole.size(), 10000u);
  EXPECT_LE(small.size(), 100u);
  EXPECT_GT(small.size(), 30u);
  small += other;
  EXPECT_LE(small.size(), 100u);
  EXPECT_GT(small.size(), 3u);
  for (uint64_t i = 0; i < 10000; ++i) {
    const CacheLog::Use* use = small.find(key(i));
    if (!use) continue;
    const bool twice = i >= 5000 && i < 6000;
    EXPECT_EQ(use->lookups, i % 3 + 1 + twice);
    EXPECT_EQ(use->fills, 1u + twice);
    EXPECT_EQ(use->filled_at, twice ? 1e6 : double(i));
  }
}

}  // namespace
}  // namespace dapple
