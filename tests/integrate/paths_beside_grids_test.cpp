// SPDX-License-Identifier: Apache-2.0
// A frame of which a part is shaded on grids, subsurface bodies and dear shaders, and the rest traced as paths: the
// light of either, whatever the cache's size, threads and crop.
#include <gtest/gtest.h>

#include "dapple/base/parallel.h"
#include "dapple/build/integrator_factory.h"
#include "tests/integrate/distribution_scenes.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using distribution::DistributionIntegrator;
using test::build_text;
using test::expect_near;
using test::furnished_room;
using test::render_built;
using test::same_bits;

const std::string wax = R"(Material "subsurface" "rgb reflectance" [ .8 .6 .4 ] "rgb mfp" [ .02 .02 .02 ])";

struct Frame {
  int samples = 16, bounces = 2;
  double cache_mb = 100;
  bool light_groups = false;

  std::unique_ptr<const integrate::Integrator> make(const build::BuiltScene& built) const {
    build::IntegratorRequest r;
    r.type = "distribution";
    r.bounces = bounces;
    r.radiosity_cache = true;
    r.cache_mb = cache_mb;
    r.light_groups = light_groups;
    return build::make_integrator(*built.scene, r, samples, 0);
  }
  test::RenderedText render(build::BuiltScene& built) const {
    built.scene->film.light_groups = light_groups ? int(built.scene->light_groups.names.size()) : 0;
    return render_built(built, samples, *make(built));
  }
};

integrate::CacheCounts counts_of(const test::RenderedText& rendered, const std::string& name) {
  for (const integrate::CacheState& c : rendered.result.caches)
    if (c.name == name) return c.counts;
  ADD_FAILURE() << "no cache " << name;
  return {};
}

TEST(PathsBesideGrids, BringTheLightOfPaths) {
  for (const std::string& material : {test::dear_material(), wax}) {
    auto built = build_text(furnished_room(material));
    const auto frame = Frame{.samples = 128};
    EXPECT_TRUE(frame.make(built)->tells_direct()) << "paths are traced";
    const auto rendered = frame.render(built);
    expect_near(rendered.mean(), render_built(built, 512, test::bounces(2)).mean(), 0.02f, material);
    EXPECT_GT(counts_of(rendered, "grids").lookups, 0u);
    EXPECT_GT(counts_of(rendered, "radiosity.depth1").hits, 0u);
  }
}

TEST(PathsBesideGrids, AreTheSameForAnyNumberOfThreadsAndAnyCache) {
  auto built = build_text(furnished_room(wax));
  Frame frame{.bounces = 3};
  set_thread_count(1);
  const auto alone = frame.render(built);
  set_thread_count(4);
  EXPECT_TRUE(same_bits(alone.film, frame.render(built).film));
  frame.cache_mb = 0.1;
  EXPECT_TRUE(same_bits(alone.film, frame.render(built).film));
  set_thread_count(0);
}

TEST(PathsBesideGrids, DoNotDependOnTheCrop) {
  auto built = build_text(furnished_room(test::dear_material()));
  const auto whole = Frame{}.render(built);
  const Box2i crop(V2i(7, 5), V2i(29, 40));
  built.scene->film.crop = crop;
  const auto part = Frame{}.render(built);
  for (int y = crop.min.y; y < crop.max.y; ++y)
    for (int x = crop.min.x; x < crop.max.x; ++x)
      for (int c = 0; c < 3; ++c) ASSERT_EQ(whole.film.pixel(x, y)[c], part.film.pixel(x, y)[c]) << x << ", " << y;
}

TEST(PathsBesideGrids, BringThePartsOfLightGroups) {
  auto built = build_text(furnished_room(
      wax + "\nLightSource \"point\" \"rgb I\" [ 1 2 3 ] \"point3 from\" [ 1 -1 1.5 ] \"string group\" \"key\"\n"));
  ASSERT_EQ(built.scene->light_groups.names.size(), 2u);
  const auto whole = Frame{}.render(built), parts = Frame{.light_groups = true}.render(built);
  EXPECT_TRUE(same_bits(whole.film, parts.film));
  RGB key;
  for (int y = 0; y < parts.film.height(); ++y)
    for (int x = 0; x < parts.film.width(); ++x) {
      const RGB sum = parts.film.light_group(x, y, 0) + parts.film.light_group(x, y, 1);
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(sum[c], parts.film.pixel(x, y)[c], 2e-4f * std::max(parts.film.pixel(x, y)[c], 0.01f));
      key += parts.film.light_group(x, y, 1);
    }
  EXPECT_GT(key.min(), 0);
}

// Every sample of every pixel has described what it sees, whoever lit it.
TEST(PathsBesideGrids, DescribeWhatTheySee) {
  auto built = build_text(furnished_room(wax));
  const auto rendered = Frame{.samples = 4}.render(built);
  const auto traced = render_built(built, 4, test::bounces(2));
  for (int y = 0; y < rendered.film.height(); ++y)
    for (int x = 0; x < rendered.film.width(); ++x)
      ASSERT_NEAR(rendered.film.features(x, y).alpha, traced.film.features(x, y).alpha, 1e-5f) << x << ", " << y;
}

// Haze in a glass box before what grids shade: rays that meet it first are paths, which fly through it.
TEST(PathsBesideGrids, SeeThroughMedia) {
  auto built = build_text(furnished_room(wax + R"(
MakeNamedMedium "haze" "string type" "homogeneous" "rgb sigma_a" [ .1 .1 .1 ] "rgb sigma_s" [ .4 .5 .6 ]
AttributeBegin
  Material "interface"
  MediumInterface "haze" ""
  Translate 0 -.5 .7
  Shape "sphere" "float radius" .4
AttributeEnd
)"));
  expect_near(Frame{.samples = 128}.render(built).mean(), render_built(built, 512, test::bounces(2)).mean(), 0.02f,
              "haze");
}

}  // namespace
}  // namespace dapple
