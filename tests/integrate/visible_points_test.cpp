// SPDX-License-Identifier: Apache-2.0
// What the camera sees, shaded for each camera sample (VisiblePoints::samples): the light of shading grids and of path
// tracing, without their points; dear shaders stay on grids.
#include <gtest/gtest.h>

#include "dapple/base/hash.h"
#include "dapple/build/integrator_factory.h"
#include "tests/integrate/distribution_scenes.h"
#include "tests/integrate/film_checks.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using distribution::DistributionIntegrator;
using distribution::VisiblePoints;
using integrate::CacheState;
using test::build_text;
using test::expect_near;
using test::expect_same_whatever_threads_and_memory;
using test::film;
using test::furnished_room;
using test::little_cache;
using test::render_built;
using test::same_bits;

DistributionIntegrator::Settings of_samples(int bounces, bool cache) {
  DistributionIntegrator::Settings s;
  s.visible_points = VisiblePoints::samples;
  s.shading.bounces = bounces;
  s.shading.shadow_rays = {16, 4, 1};
  s.shading.diffuse_rays = {64, 4, 1};
  s.radiosity_cache = cache;
  return s;
}

uint64_t lookups(const test::RenderedText& rendered, const std::string& name) {
  for (const CacheState& c : rendered.result.caches)
    if (c.name == name) return c.counts.lookups;
  ADD_FAILURE() << "no cache " << name;
  return 0;
}

const std::string varnished = R"(Material "coateddiffuse" "rgb reflectance" [ .3 .5 .2 ] "float roughness" 0.1)";

TEST(VisiblePoints, OfSamplesShowTheLightOfPaths) {
  const auto built = build_text(furnished_room(varnished));
  const RGB expected = render_built(built, 512, test::bounces(2)).mean();
  expect_near(render_built(built, 64, of_samples(2, false)).mean(), expected, 0.01f, "uncached");
  expect_near(render_built(built, 64, of_samples(2, true)).mean(), expected, 0.02f, "cached");
}

TEST(VisiblePoints, OfSamplesNeedNoGridsWhereShadersAreCheap) {
  const auto built = build_text(furnished_room(varnished));
  auto s = of_samples(1, true);
  EXPECT_EQ(lookups(render_built(built, 4, s), "grids"), 0u);
  s.visible_points = VisiblePoints::grids;
  EXPECT_GT(lookups(render_built(built, 4, s), "grids"), 0u);
}

TEST(VisiblePoints, OfDearShadersLieOnGrids) {
  const auto built = build_text(furnished_room(test::dear_material()));
  EXPECT_GT(lookups(render_built(built, 4, of_samples(1, true)), "grids"), 0u);
}

TEST(VisiblePoints, OfSamplesAreTheSameForAnyNumberOfThreadsAndAnyCache) {
  const auto built = build_text(furnished_room(varnished));
  auto s = of_samples(3, true);
  expect_same_whatever_threads_and_memory([&](bool little) {
    if (little) s.cache_bytes = little_cache;
    return render_built(built, 4, s).film;
  });
}

// A hall under a sky that only a hole in its roof shows, a lamp of glowing leaves and a sun: what shadow rays find, and
// what diffuse rays find, must add up to one light.
TEST(VisiblePoints, DiffuseRaysAndShadowRaysShareLights) {
  const auto built = build_text(film(32) + R"(LookAt 0 -3 1  0 0 .7  0 0 1
Camera "perspective" "float fov" 60
WorldBegin
LightSource "infinite" "rgb L" [ 2 3 5 ]
LightSource "distant" "point3 from" [ .3 .2 1 ] "point3 to" [ 0 0 0 ] "rgb L" [ 4 4 3 ]
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 2 1 .5 ] "bool twosided" true
  Shape "bilinearmesh" "point3 P" [ -1.9 -1 .2  -1.9 1 .2  -1.7 -1 1.5  -1.7 1 1.5 ]
AttributeEnd
Material "diffuse" "rgb reflectance" [ .6 .6 .6 ]
Shape "bilinearmesh" "point3 P" [ -2 -4 0  2 -4 0  -2 2 0  2 2 0 ]
Shape "bilinearmesh" "point3 P" [ -2 2 0  2 2 0  -2 2 2  2 2 2 ]
Shape "bilinearmesh" "point3 P" [ -2 -4 0  -2 2 0  -2 -4 2  -2 2 2 ]
Shape "bilinearmesh" "point3 P" [ 2 -4 0  2 2 0  2 -4 2  2 2 2 ]
Shape "bilinearmesh" "point3 P" [ -2 -4 2  2 -4 2  -2 -1 2  2 -1 2 ]
Material "diffusetransmission" "rgb reflectance" [ .2 .3 .1 ] "rgb transmittance" [ .2 .4 .1 ]
Translate .3 0 .9
Rotate 40 1 1 0
Shape "disk" "float radius" .5
)");
  for (const int bounces : {1, 2}) {
    const RGB expected = render_built(built, 1024, test::bounces(bounces)).mean();
    for (const VisiblePoints points : {VisiblePoints::grids, VisiblePoints::samples}) {
      auto s = of_samples(bounces, false);
      s.visible_points = points;
      expect_near(render_built(built, 64, s).mean(), expected, 0.01f, "bounces " + std::to_string(bounces));
      // One cell does not speak for all of the hall.
      s.radiosity_cache = true;
      expect_near(render_built(built, 64, s).mean(), expected, 0.02f, "cached");
    }
  }
}

// Leaves by the thousand: groups of them are not cached where they are cheap, and Russian roulette takes no light.
TEST(VisiblePoints, RaysThatGoOnFromLeavesKeepTheLight) {
  std::string leaves, indices;
  KeyedRng rng(5);
  for (int leaf = 0; leaf < 3000; ++leaf) {
    const V3f n = normalize(V3f(rng.next() - .5f, rng.next() - .5f, rng.next() - .5f));
    V3f s, t;
    coordinate_system(n, &s, &t);
    const V3f c(2 * rng.next() - 1, 2 * rng.next() - 1, 2 * rng.next());
    for (const V2f& q : {V2f(-1, -1), V2f(1, -1), V2f(-1, 1), V2f(1, 1)}) {
      const V3f p = c + (s * q.x + t * q.y) * 0.03f;
      leaves += std::to_string(p.x) + " " + std::to_string(p.y) + " " + std::to_string(p.z) + " ";
    }
    for (int v = 0; v < 4; ++v) indices += std::to_string(4 * leaf + v) + " ";
  }
  const auto built = build_text(film(32) + R"(LookAt 0 -4 1  0 0 1  0 0 1
Camera "perspective" "float fov" 40
WorldBegin
LightSource "infinite" "rgb L" [ .5 .6 1 ]
LightSource "distant" "point3 from" [ .3 -.6 1 ] "point3 to" [ 0 0 0 ] "rgb L" [ 3 3 3 ]
Material "diffusetransmission" "rgb reflectance" [ .4 .4 .1 ] "rgb transmittance" [ .4 .5 .1 ]
Shape "bilinearmesh" "point3 P" [ )" +
                                leaves + "] \"integer indices\" [ " + indices + "]\n");
  const RGB expected = render_built(built, 512, test::bounces(5)).mean();
  expect_near(render_built(built, 64, of_samples(5, true)).mean(), expected, 0.015f, "leaves");
}

// Thousands of small leaves over ground under a sky.
std::string leaves() {
  std::string P, indices;
  for (uint32_t i = 0; i < 4000; ++i) {
    const auto u = [i](uint32_t k) { return to_unit_float(hash(i, k)); };
    const float x = 8 * u(0) - 4, y = 4 * u(1), z = 8 * u(2) - 4;
    const float corners[3][3] = {{x, y, z}, {x + .1f * u(3), y + .1f, z}, {x, y + .1f * u(4), z + .1f}};
    for (const auto& c : corners)
      for (const float v : c) P += std::to_string(v) + " ";
    for (uint32_t k = 0; k < 3; ++k) indices += std::to_string(3 * i + k) + " ";
  }
  return R"(Film "rgb" "integer xresolution" 32 "integer yresolution" 24
LookAt 0 2 -9  0 2 0  0 1 0
Camera "perspective" "float fov" 50
WorldBegin
LightSource "infinite" "rgb L" [ 1 1 1 ]
Material "diffusetransmission" "rgb reflectance" [ .3 .4 .2 ] "rgb transmittance" [ .2 .3 .1 ]
Shape "trianglemesh" "point3 P" [ )" +
         P + "] \"integer indices\" [ " + indices + R"(]
Material "diffuse" "rgb reflectance" [ .3 .3 .3 ]
Shape "trianglemesh" "point3 P" [ -50 0 -50  50 0 -50  50 0 50  -50 0 50 ] "integer indices" [ 0 1 2  0 2 3 ]
)";
}

std::unique_ptr<const integrate::Integrator> made(const build::BuiltScene& built, const std::string& type,
                                                  std::optional<bool> cache) {
  build::IntegratorRequest r;
  r.type = type;
  r.bounces = 2;
  r.radiosity_cache = cache;
  return build::make_integrator(*built.scene, r, 4, 0);
}

bool has_caches(const integrate::Integrator& integrator) {
  return !integrator.caches().empty();
}

TEST(VisiblePoints, AreTracedAsPathsWhereCellsWouldAnswerFewRays) {
  const auto forest = build_text(leaves());
  const auto chosen = made(forest, "distribution", {}), path = made(forest, "path", {});
  EXPECT_FALSE(has_caches(*chosen));
  EXPECT_TRUE(same_bits(render_built(forest, 4, *chosen).film, render_built(forest, 4, *path).film));
  EXPECT_TRUE(has_caches(*made(forest, "distribution", true)));
}

TEST(VisiblePoints, EndInTheCacheWhereManyRaysReadIt) {
  EXPECT_TRUE(has_caches(*made(build_text(furnished_room(varnished)), "distribution", {})));
}

// The haze weakens the light of what is shaded on grids, too.
TEST(VisiblePoints, InHazeAreTracedAsPathsWhereAllAre) {
  const std::string wax = "Material \"subsurface\" \"rgb reflectance\" [ .7 .5 .4 ] \"rgb mfp\" [ .002 .002 .002 ]\n";
  for (const std::string& material : {std::string(varnished), test::dear_material(), wax}) {
    const bool all = material == varnished;
    std::string text = furnished_room(material);
    text.insert(
        text.find("Camera"),
        "MakeNamedMedium \"haze\" \"string type\" \"homogeneous\" \"rgb sigma_s\" [ .08 .08 .08 ] \"rgb sigma_a\" [ "
        ".1 .1 .1 ]\nMediumInterface \"\" \"haze\"\n");
    const auto room = build_text(text);
    ASSERT_NE(room.scene->camera_medium, scene::vacuum);
    const auto chosen = made(room, "distribution", {});
    EXPECT_EQ(dynamic_cast<const path::PathIntegrator*>(chosen.get()) != nullptr, all);
    expect_near(render_built(room, 64, *chosen).mean(), render_built(room, 256, test::bounces(2)).mean(), 0.03f,
                material);
  }
}

// Paths would follow what metal mirrors, which is not asked for.
TEST(VisiblePoints, EndInTheCacheWhereMetalCountsAsDiffuse) {
  std::string text = leaves();
  const std::string ground = "Material \"diffuse\" \"rgb reflectance\" [ .3 .3 .3 ]";
  text.replace(text.find(ground), ground.size(), "Material \"conductor\"");
  const auto built = build_text(text);
  build::IntegratorRequest r;
  r.type = "distribution", r.bounces = 2, r.caustics = true;
  EXPECT_FALSE(has_caches(*build::make_integrator(*built.scene, r, 4, 0)));
  r.caustics = false;
  EXPECT_TRUE(has_caches(*build::make_integrator(*built.scene, r, 4, 0)));
}

}  // namespace
}  // namespace dapple
