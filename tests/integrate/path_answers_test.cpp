// SPDX-License-Identifier: Apache-2.0
// Camera samples traced as paths that end in the radiosity cache: the light of path tracing, whatever the cache's size,
// threads and crop.
#include "dapple/distribution/path_answers.h"

#include <gtest/gtest.h>

#include "dapple/build/integrator_factory.h"
#include "tests/integrate/distribution_scenes.h"
#include "tests/integrate/film_checks.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using distribution::DistributionIntegrator;
using distribution::VisiblePoints;
using test::build_text;
using test::expect_near;
using test::expect_part_of;
using test::expect_parts_add_up;
using test::expect_same_whatever_threads_and_memory;
using test::furnished_room;
using test::little_cache;
using test::render_built;
using test::same_bits;

const std::string varnished = R"(Material "coateddiffuse" "rgb reflectance" [ .3 .5 .2 ] "float roughness" 0.1)";

struct Cached {
  int samples = 16, bounces = 2;
  size_t cache_bytes = size_t(100) << 20;
  bool light_groups = false;

  std::unique_ptr<const integrate::Integrator> make(const build::BuiltScene& built) const {
    DistributionIntegrator::Settings s;
    s.visible_points = VisiblePoints::samples;
    s.shading.bounces = bounces;
    s.shading.shadow_rays = {16, 4, 1};
    s.shading.diffuse_rays = {64, 4, 1};
    s.pixel_samples = samples;
    s.cache_bytes = cache_bytes;
    s.light_groups = light_groups;
    const auto cache = std::make_shared<const DistributionIntegrator>(*built.scene, s);
    EXPECT_NE(cache->answers(), nullptr);
    path::PathIntegrator::Settings p = test::bounces(bounces, s.shading.specular_depth);
    p.radiosity = {cache, cache->answers()};
    return std::make_unique<path::PathIntegrator>(*built.scene, p);
  }
  test::RenderedText render(build::BuiltScene& built) const {
    built.scene->film.light_groups = light_groups ? int(built.scene->light_groups.names.size()) : 0;
    return render_built(built, samples, *make(built));
  }
};

uint64_t lookups(const test::RenderedText& rendered, const std::string& name) {
  for (const integrate::CacheState& c : rendered.result.caches)
    if (c.name == name) return c.counts.lookups;
  ADD_FAILURE() << "no cache " << name;
  return 0;
}

TEST(PathAnswers, BringTheLightOfPaths) {
  for (const std::string& material : {std::string(R"(Material "diffuse" "rgb reflectance" [ .3 .5 .2 ])"), varnished}) {
    auto built = build_text(furnished_room(material));
    for (const int bounces : {1, 3}) {
      const RGB expected = render_built(built, 512, test::bounces(bounces)).mean();
      const auto cached = Cached{.samples = 256, .bounces = bounces}.render(built);
      expect_near(cached.mean(), expected, 0.015f, "bounces " + std::to_string(bounces) + " " + material);
      EXPECT_GT(lookups(cached, "radiosity.depth1"), 0u);
      if (bounces > 1) {
        EXPECT_GT(lookups(cached, "radiosity.depth2"), 0u);
      }
    }
  }
}

TEST(PathAnswers, SendFewerRaysThanPaths) {
  auto built = build_text(furnished_room(varnished));
  const auto rays = [](const test::RenderedText& r) { return double(r.result.rays.total()); };
  EXPECT_LT(rays(Cached{.samples = 256, .bounces = 4}.render(built)),
            .9 * rays(render_built(built, 256, test::bounces(4))));
}

TEST(PathAnswers, AreTheSameForAnyNumberOfThreadsAndAnyCache) {
  auto built = build_text(furnished_room(varnished));
  Cached settings{.bounces = 3};
  expect_same_whatever_threads_and_memory([&](bool little) {
    if (little) settings.cache_bytes = little_cache;
    return settings.render(built).film;
  });
}

TEST(PathAnswers, DoNotDependOnTheCrop) {
  auto built = build_text(furnished_room(varnished));
  const auto whole = Cached{}.render(built);
  const Box2i crop(V2i(7, 5), V2i(29, 20));
  built.scene->film.crop = crop;
  const auto part = Cached{}.render(built);
  expect_part_of(whole.film, part.film);
}

TEST(PathAnswers, BringThePartsOfLightGroups) {
  auto built = build_text(furnished_room(
      varnished +
      "\nLightSource \"point\" \"rgb I\" [ 1 2 3 ] \"point3 from\" [ 1 -1 1.5 ] \"string group\" \"key\"\n"));
  ASSERT_EQ(built.scene->light_groups.names.size(), 2u);
  const auto whole = Cached{}.render(built), parts = Cached{.light_groups = true}.render(built);
  EXPECT_TRUE(same_bits(whole.film, parts.film));
  EXPECT_GT(expect_parts_add_up(parts.film).min(), 0);
}

// What is shaded on grids, or counts metal as diffuse, is no path.
TEST(PathAnswers, AreForWhatPathsCanTrace) {
  auto built = build_text(furnished_room(R"(Material "conductor" "float roughness" .3)"));
  DistributionIntegrator::Settings s;
  EXPECT_EQ(DistributionIntegrator(*built.scene, s).answers(), nullptr) << "on grids";
  s.visible_points = VisiblePoints::samples;
  EXPECT_NE(DistributionIntegrator(*built.scene, s).answers(), nullptr);
  s.shading.caustics = false;
  EXPECT_EQ(DistributionIntegrator(*built.scene, s).answers(), nullptr) << "metal counts as diffuse";
  s.shading.caustics = true;
  s.radiosity_cache = false;
  EXPECT_EQ(DistributionIntegrator(*built.scene, s).answers(), nullptr) << "no cache";
}

TEST(PathAnswers, AreReadByTheDefault) {
  auto built = build_text(furnished_room(varnished));
  build::IntegratorRequest request;
  request.type = "distribution";
  request.radiosity_cache = true;
  const auto made = build::make_integrator(*built.scene, request, 16, 0);
  const auto* paths = dynamic_cast<const path::PathIntegrator*>(made.get());
  ASSERT_NE(paths, nullptr);
  EXPECT_TRUE(paths->ends_in_cache());
}

}  // namespace
}  // namespace dapple
