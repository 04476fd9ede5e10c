// SPDX-License-Identifier: Apache-2.0
// A frame of which a part is shaded on grids, subsurface bodies and dear shaders, and the rest traced as paths: the
// light of either, whatever the cache's size, threads and crop.
#include <gtest/gtest.h>

#include "dapple/build/integrator_factory.h"
#include "tests/integrate/distribution_scenes.h"
#include "tests/integrate/film_checks.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using distribution::DistributionIntegrator;
using test::build_text;
using test::expect_near;
using test::expect_part_of;
using test::expect_parts_add_up;
using test::expect_same_whatever_threads_and_memory;
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

// Two materials by chance, of which one is a body: no grid serves that.
const std::string waxed =
    "MakeNamedMaterial \"wax\" \"string type\" \"subsurface\" \"rgb reflectance\" [ .8 .6 .4 ] "
    "\"rgb mfp\" [ .02 .02 .02 ]\n"
    "MakeNamedMaterial \"plain\" \"string type\" \"diffuse\" \"rgb reflectance\" [ .3 .4 .5 ]\n"
    "Material \"mix\" \"string materials\" [ \"wax\" \"plain\" ]\n";

TEST(PathsBesideGrids, BringTheLightOfPaths) {
  for (const std::string& material : {test::dear_material(), wax, waxed}) {
    auto built = build_text(furnished_room(material));
    const auto frame = Frame{.samples = 128};
    EXPECT_TRUE(frame.make(built)->tells_direct()) << "paths are traced";
    EXPECT_FALSE(frame.make(built)->tells_all_direct());
    const auto rendered = frame.render(built);
    const float error = material == waxed ? 0.04f : 0.02f;  // of diffusion, too
    expect_near(rendered.mean(), render_built(built, 512, test::bounces(2)).mean(), error, material);
    EXPECT_EQ(counts_of(rendered, "grids").lookups > 0, material != waxed);
    EXPECT_GT(counts_of(rendered, "radiosity.depth1").hits, 0u);
  }
}

// A screen of small leaves of a dear shader, of which a pixel chooses some, before the balls.
std::string dear_leaves() {
  std::string P, indices;
  for (int i = 0; i < 1200; ++i) {
    const V3f c(-.9f + 1.8f * float(i % 40) / 40, -.6f + .01f * float(i % 7), .2f + 1.3f * float(i / 40) / 30);
    for (const V2f& q : {V2f(0, 0), V2f(1, 0), V2f(0, 1), V2f(1, 1)}) {
      const V3f p = c + V3f(q.x, .3f * q.x, q.y) * .012f;
      P += std::to_string(p.x) + " " + std::to_string(p.y) + " " + std::to_string(p.z) + " ";
    }
    for (int v = 0; v < 4; ++v) indices += std::to_string(4 * i + v) + " ";
  }
  return furnished_room(wax) + "Translate -.7 -.6 -.5\n" + test::dear_material() +
         "Shape \"bilinearmesh\" \"point3 P\" [ " + P + "] \"integer indices\" [ " + indices + "]\n";
}

TEST(PathsBesideGrids, AreTheSameForAnyNumberOfThreadsAndAnyCache) {
  auto built = build_text(dear_leaves());
  Frame frame{.bounces = 3};
  expect_same_whatever_threads_and_memory([&](bool little) {
    if (little) frame.cache_mb = 0.1;
    return frame.render(built).film;
  });
}

// Samples of grids wait for their points; those of paths in the same pixel wait with them, so that what depends on the
// order of samples is the same, bit for bit, as where each sample is finished before the next.
TEST(PathsBesideGrids, AreAddedInTheirOrder) {
  const auto built = build_text(furnished_room(wax));
  const auto made = Frame{}.make(built);
  const auto render = [&](uint32_t at_once) {
    scene::Film film(built.scene->film);
    made->begin_again();
    std::vector<std::unique_ptr<integrate::Integrator::Workspace>> workspaces;
    workspaces.push_back(made->make_workspace());
    for (uint32_t first = 0; first < 16; first += at_once) {
      made->render({film.settings().crop, first, at_once, 16}, *workspaces[0], film);
      made->finish(workspaces, film);
    }
    return film;
  };
  const scene::Film waited = render(16), finished = render(1);
  for (int y = 0; y < waited.height(); ++y)
    for (int x = 0; x < waited.width(); ++x)
      for (int c = 0; c < 3; ++c) ASSERT_EQ(waited.variance(x, y)[c], finished.variance(x, y)[c]) << x << ", " << y;
}

TEST(PathsBesideGrids, DoNotDependOnTheCrop) {
  auto built = build_text(dear_leaves());
  const auto whole = Frame{}.render(built);
  const Box2i crop(V2i(7, 5), V2i(29, 40));
  built.scene->film.crop = crop;
  const auto part = Frame{}.render(built);
  expect_part_of(whole.film, part.film);
}

TEST(PathsBesideGrids, BringThePartsOfLightGroups) {
  auto built = build_text(furnished_room(
      wax + "\nLightSource \"point\" \"rgb I\" [ 1 2 3 ] \"point3 from\" [ 1 -1 1.5 ] \"string group\" \"key\"\n"));
  ASSERT_EQ(built.scene->light_groups.names.size(), 2u);
  const auto whole = Frame{}.render(built), parts = Frame{.light_groups = true}.render(built);
  EXPECT_TRUE(same_bits(whole.film, parts.film));
  EXPECT_GT(expect_parts_add_up(parts.film).min(), 0);
}

// Every sample of every pixel has described what it sees, whoever lit it. Light that paths call direct is less than all
// of it, and none where every sample meets a ball.
TEST(PathsBesideGrids, DescribeWhatTheySee) {
  auto built = build_text(furnished_room(wax));
  built.scene->film.direct = true;
  const auto rendered = Frame{.samples = 4}.render(built);
  const auto traced = render_built(built, 4, test::bounces(2));
  const V2i ball(14, 31), wall(24, 14);
  for (int y = 0; y < rendered.film.height(); ++y)
    for (int x = 0; x < rendered.film.width(); ++x) {
      const scene::Features found = rendered.film.features(x, y), expected = traced.film.features(x, y);
      ASSERT_NEAR(found.alpha, expected.alpha, 1e-5f) << x << ", " << y;
      ASSERT_NEAR(found.depth, expected.depth, 1e-3f) << x << ", " << y;
    }
  EXPECT_GT(rendered.film.direct(wall.x, wall.y).min(), 0);
  EXPECT_EQ(rendered.film.direct(ball.x, ball.y).max(), 0);
  EXPECT_GT(rendered.film.pixel(ball.x, ball.y).min(), 0);
}

// Before a mirror that is as wide as the picture: the paths see the wax by it, and walk through it, down to a plate
// that stands in it. What they meet there no cell of surfaces answers.
TEST(PathsBesideGrids, WalkThroughBodiesInMirrors) {
  const std::string scene = furnished_room(wax) + R"(
Material "diffuse" "rgb reflectance" [ .9 .9 .9 ]
Shape "bilinearmesh" "point3 P" [ -.6 -.3 -.1  .6 -.3 -.1  -.6 .3 -.1  .6 .3 -.1 ]
Translate -.7 -.6 -.5
Material "conductor" "float roughness" 0
Shape "bilinearmesh" "point3 P" [ -1.9 1.9 0  1.9 1.9 0  -1.9 1.9 1.9  1.9 1.9 1.9 ]
)";
  auto built = build_text(scene);
  expect_near(Frame{.samples = 128, .bounces = 3}.render(built).mean(),
              render_built(built, 512, test::bounces(3)).mean(), 0.02f, "mirror");
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

// What the probe compares: the pixels of paths, and black where others are.
TEST(PathsBesideGrids, AreComparedWithoutTheOthers) {
  const auto built = build_text(furnished_room(wax));
  std::vector<uint8_t> others;
  for (const scene::GeometryBinding& b : built.scene->bindings)
    others.push_back(built.scene->materials[size_t(b.material)]->has_subsurface());
  const path::PathIntegrator paths(*built.scene, test::bounces(2));
  const auto whole = render_built(built, 4, paths);
  const auto alone = render_built(built, 4, integrate::PathsAlone(*built.scene, paths, others, 0));
  int black = 0, same = 0;
  for (int y = 0; y < whole.film.height(); ++y)
    for (int x = 0; x < whole.film.width(); ++x) {
      const RGB p = whole.film.pixel(x, y), q = alone.film.pixel(x, y);
      black += q.is_black();
      same += p.r == q.r && p.g == q.g && p.b == q.b;
    }
  EXPECT_GT(black, 100);
  EXPECT_GT(same, 1000);
  EXPECT_GT(black + same, 48 * 48 - 100) << "the rest lies on silhouettes";
}

}  // namespace
}  // namespace dapple
