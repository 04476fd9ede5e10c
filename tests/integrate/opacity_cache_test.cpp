// SPDX-License-Identifier: Apache-2.0
// The opacity cache: its values, its names, its memory, and what it does to whole renders.
#include "dapple/gi/opacity_cache.h"

#include <gtest/gtest.h>

#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"
#include "dapple/image/image_writer.h"
#include "dapple/path/ambient_occlusion.h"
#include "dapple/shading/opacity_texture.h"
#include "tests/support/process.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using gi::OpacityCache;
using test::build_text;
using test::render_built;
using test::same_bits;
using trace::OpacityTest;

constexpr const char* head = R"(Film "rgb" "integer xresolution" 64 "integer yresolution" 48
PixelFilter "box"
LookAt 0 -6 2.5  0 0 1  0 0 1
Camera "perspective" "float fov" 35
WorldBegin
LightSource "distant" "rgb L" [ 3 3 3 ] "point3 from" [ .4 -.3 1 ]
LightSource "infinite" "rgb L" [ .4 .4 .4 ]
Texture "u" "float" "coordinate" "string which" "u"
Texture "v" "float" "coordinate" "string which" "v"
Texture "in plane" "float" "fbm" "texture x" "u" "texture y" "v" "float z" .5
Texture "ragged" "float" "smoothstep" "texture in" "in plane" "float low" -.1 "float high" .1
Texture "in space" "float" "fbm"
Texture "spotted" "float" "smoothstep" "texture in" "in space" "float low" -.1 "float high" .1
Texture "tint in plane" "spectrum" "mix" "rgb tex1" [ .1 0 0 ] "rgb tex2" [ 1 .7 .2 ] "texture amount" "ragged"
Texture "tint in space" "spectrum" "mix" "rgb tex1" [ .1 0 0 ] "rgb tex2" [ 1 .7 .2 ] "texture amount" "spotted"
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
Shape "bilinearmesh" "point3 P" [ -9 -9 0  9 -9 0  -9 9 0  9 9 0 ]
)";

// 60 cards in a ball.
std::string cards(const std::string& alpha) {
  const std::string parameter = alpha.starts_with("tint") ? "opacity" : "alpha";
  KeyedRng rng(7);
  std::string P, uv, indices;
  for (int i = 0; i < 60; ++i) {
    V3f c, x, y;
    for (V3f* v : {&c, &x, &y}) *v = V3f(2 * rng.next() - 1, 2 * rng.next() - 1, 2 * rng.next() - 1);
    c.z += 1.2f;
    for (const auto& [s, t] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
      const V3f p = c + x * (0.3f * float(s)) + y * (0.3f * float(t));
      P += std::to_string(p.x) + " " + std::to_string(p.y) + " " + std::to_string(p.z) + " ";
      uv += std::to_string((s + 1) / 2) + " " + std::to_string((t + 1) / 2) + " ";
    }
    for (const int k : {0, 1, 2, 0, 2, 3}) indices += std::to_string(4 * i + k) + " ";
  }
  return "Shape \"trianglemesh\" \"point3 P\" [ " + P + "] \"point2 uv\" [ " + uv + "] \"integer indices\" [ " +
         indices + "] \"texture " + parameter + "\" \"" + alpha + "\"\n";
}

constexpr uint32_t card_geometry = 1;  // after the ground

// A card is a unit square on u and v: triangle (0, 0), (1, 0), (1, 1).
OpacityTest::Hit hit_at(float u, float v, float width, float area = 1) {
  return {card_geometry, 0, u - v, v, 0.5f, width, area};
}

// A width that asks for this level: cells of exactly this width, or up to twice as wide, belong to the next coarser.
float width_of(int level) {
  return 1.5f / float(1 << level);
}

uint8_t byte_of(float alpha) {
  return uint8_t(std::lround(alpha * 255));
}

float direct(const scene::Scene& scene, const OpacityTest::Hit& h) {
  float alpha = -1;
  scene.opacity(h.geometry, 1, &h.primitive, &h.u, &h.v, &h.time, &alpha);
  return alpha;
}

float cached(const OpacityCache& cache, const OpacityTest::Hit& h) {
  OpacityTest::Counts counts;
  const float alpha = cache.seen_opacity(h, &counts);
  cache.add(counts);
  return alpha;
}

TEST(OpacityCache, LevelsHaveCellsNoWiderThanTheFootprint) {
  for (int level = OpacityCache::min_level; level < OpacityCache::max_level; ++level) {
    EXPECT_EQ(OpacityCache::level_of(1, width_of(level)), level);
    EXPECT_EQ(OpacityCache::level_of(100, 10 * width_of(level)), level);
  }
  EXPECT_EQ(OpacityCache::level_of(1, 5), OpacityCache::min_level);
  EXPECT_EQ(OpacityCache::level_of(1, infinity), OpacityCache::min_level);
  for (const float finer : {1e-5f, 0.0f}) EXPECT_GT(OpacityCache::level_of(1, finer), OpacityCache::max_level);
}

TEST(OpacityCache, PlanePatternsAreRightAtTheLattice) {
  const auto built = build_text(head + cards("ragged"));
  const OpacityCache cache(*built.scene, 1 << 20);
  KeyedRng rng(3);
  for (const int level : {6, 8, 10})
    for (int i = 0; i < 200; ++i) {
      const int cells = 1 << level;
      const int y = int(rng.next() * float(cells) / 2), x = cells / 2 + int(rng.next() * float(cells) / 2);
      const float size = 1 / float(cells), u = (float(x) + 0.5f) * size, v = (float(y) + 0.5f) * size;
      const float expected = direct(*built.scene, hit_at(u, v, 0));
      for (const float off : {0.0f, 0.4f * size})  // all of the cell is its middle
        EXPECT_NEAR(cached(cache, hit_at(u + off, v - off, width_of(level))) * 255, byte_of(expected), 1.01)
            << level << " " << x << " " << y;
    }
}

RGB direct_color(const scene::Scene& scene, const OpacityTest::Hit& h) {
  RGB alpha;
  scene.colored_opacity(h.geometry, 1, &h.primitive, &h.u, &h.v, &h.time, &alpha);
  return alpha;
}

TEST(OpacityCache, KeepsChannelsApart) {
  for (const bool plane : {true, false}) {
    const auto built = build_text(head + cards(plane ? "tint in plane" : "tint in space"));
    const OpacityCache cache(*built.scene, 1 << 20);
    KeyedRng rng(6);
    OpacityTest::Counts counts;
    bool differ = false;
    for (const int level : {6, 8})
      for (int i = 0; i < 200; ++i) {
        const int cells = 1 << level;
        const int y = int(rng.next() * float(cells) / 2), x = cells / 2 + int(rng.next() * float(cells) / 2);
        OpacityTest::Hit hit =
            hit_at((float(x) + 0.5f) / float(cells), (float(y) + 0.5f) / float(cells), width_of(level));
        OpacityTest::Hit there = hit;
        if (!plane) {
          const V2f p = OpacityCache::point_in_cell(card_geometry, 0, true, level, int(hit.u * float(cells)),
                                                    int(hit.v * float(cells)));
          there.u = p.x, there.v = p.y;
        }
        const RGB expected = direct_color(*built.scene, there);
        for (int again = 0; again < 8; ++again) {  // computed alone, then from a tile
          const RGB found = cache.seen_colored_opacity(hit, &counts);
          for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(found[c], expected[c], 1.01f / 255) << plane << " " << level << " " << x << " " << y;
        }
        differ |= expected.r > 2 * expected.b;
        hit.width = 0;
        EXPECT_EQ(cache.seen_colored_opacity(hit, &counts), direct_color(*built.scene, hit));
      }
    EXPECT_TRUE(differ);
    EXPECT_GT(counts.hits, counts.fills);
    EXPECT_GT(counts.fills, 0u);
  }
}

// Cells that are wider than 1/64 are means: over all cells the mean of the pattern comes out.
TEST(OpacityCache, CoarseCellsAreMeans) {
  const auto built = build_text(head + cards("ragged"));
  const OpacityCache cache(*built.scene, 1 << 20);
  double exact = 0, coarse = 0;
  int n = 0;
  for (int y = 0; y < 128; ++y)
    for (int x = y; x < 128; ++x, ++n) {
      const float u = (float(x) + 0.7f) / 128, v = (float(y) + 0.3f) / 128;
      exact += double(direct(*built.scene, hit_at(u, v, 0)));
      coarse += double(cached(cache, hit_at(u, v, width_of(3))));
    }
  EXPECT_NEAR(coarse / n, exact / n, 0.01);
  EXPECT_GT(exact / n, 0.1);
  EXPECT_LT(exact / n, 0.9);
}

TEST(OpacityCache, PrimitivesAreRightAtTheirPoints) {
  const auto built = build_text(head + cards("spotted"));
  const OpacityCache cache(*built.scene, 1 << 20);
  KeyedRng rng(4);
  for (const uint32_t primitive : {0u, 31u})
    for (const int level : {3, 5, 8})
      for (int i = 0; i < 100; ++i) {
        const int cells = 1 << level;
        const int x = int(rng.next() * float(cells)), y = int(rng.next() * float(cells - x));
        const V2f p = OpacityCache::point_in_cell(card_geometry, primitive, true, level, x, y);
        ASSERT_LE(p.x + p.y, 1 + 1e-6f);
        const OpacityTest::Hit there{card_geometry, primitive, p.x, p.y, 0.5f, 0, 1};
        const OpacityTest::Hit near{
            card_geometry,   primitive, (float(x) + 0.3f) / float(cells), (float(y) + 0.3f) / float(cells), 0.9f,
            width_of(level), 1};
        EXPECT_EQ(byte_of(cached(cache, near)), byte_of(direct(*built.scene, there)));
      }
}

TEST(OpacityCache, FinerThanItsFinestIsExact) {
  for (const char* alpha : {"ragged", "spotted"}) {
    const auto built = build_text(head + cards(alpha));
    const OpacityCache cache(*built.scene, 1 << 20);
    KeyedRng rng(5);
    for (int i = 0; i < 200; ++i) {
      const float v = rng.next(), u = v + (1 - v) * rng.next(), width = i % 2 ? 0 : 1e-4f;
      EXPECT_EQ(cached(cache, hit_at(u, v, width)), direct(*built.scene, hit_at(u, v, 0)));
    }
    EXPECT_EQ(cache.state().counts.lookups, 0u);
  }
}

/// A scene whose cards bear a picture of 37 x 23 numbers of 8 bits.
class WithPicture : public testing::TestWithParam<const char*> {
 protected:
  WithPicture() {
    image::OutputImage picture;
    picture.width = picture.display_width = 37, picture.height = picture.display_height = 23;
    picture.layers.push_back({"", {"Y"}, {}, image::SampleType::full_float});
    KeyedRng rng(6);
    for (int i = 0; i < 37 * 23; ++i) picture.layers[0].pixels.push_back(float(int(rng.next() * 4) * 85) / 255);
    image::write_exr(folder.file("alpha.exr"), picture);
  }
  build::BuiltScene build(const std::string& options) const {
    return build_text(head +
                      ("Texture \"picture\" \"float\" \"imagemap\" \"string filename\" \"" + folder.file("alpha.exr") +
                       "\" " + options + "\n") +
                      cards("picture"));
  }
  test::ScratchFolder folder;
};

TEST_P(WithPicture, IsExact) {
  const auto built = build(GetParam());
  for (const size_t bytes : {size_t(0), size_t(1600), size_t(1) << 20}) {  // computed, by tiles, and whole
    const OpacityCache cache(*built.scene, bytes);
    KeyedRng rng(8);
    for (int i = 0; i < 500; ++i) {
      const float v = rng.next(), u = v + (1 - v) * rng.next();
      EXPECT_NEAR(cached(cache, hit_at(u, v, 0.01f)), direct(*built.scene, hit_at(u, v, 0)), 2e-4f) << u << " " << v;
    }
    EXPECT_LE(cache.state().bytes, bytes);
  }
}

INSTANTIATE_TEST_SUITE_P(Maps, WithPicture,
                         testing::Values("", "\"string wrap\" \"black\" \"float uscale\" 3",
                                         "\"string wrap\" \"clamp\" \"float vscale\" 2 \"float vdelta\" -.3",
                                         "\"string filter\" \"point\""));

// Values do not depend on what is kept: none, a few sets of tiles that drive each other out, or all.
TEST(OpacityCache, ValuesDoNotDependOnItsSize) {
  for (const char* alpha : {"ragged", "spotted"}) {
    const auto built = build_text(head + cards(alpha));
    std::vector<float> seen[3];
    uint64_t evictions[3];
    const size_t sizes[] = {0, 4096, 1 << 22};
    for (int k = 0; k < 3; ++k) {
      const OpacityCache cache(*built.scene, sizes[k]);
      KeyedRng rng(9);
      for (int i = 0; i < 20000; ++i) {
        const float v = rng.next(), u = v + (1 - v) * rng.next();
        seen[k].push_back(cached(cache, hit_at(u, v, width_of(4 + i % 5))));
      }
      const auto state = cache.state();
      evictions[k] = state.evictions;
      EXPECT_EQ(state.counts.lookups, 20000u);
      EXPECT_LE(state.bytes, sizes[k]);
      EXPECT_LE(state.capacity_bytes, sizes[k]);
      if (sizes[k] == 0) {
        EXPECT_EQ(state.counts.fills + state.counts.hits, 0u);
      }
    }
    EXPECT_EQ(seen[0], seen[1]);
    EXPECT_EQ(seen[0], seen[2]);
    EXPECT_GT(evictions[1], 100u);
    EXPECT_EQ(evictions[2], 0u);
  }
}

TEST(OpacityCache, AsksAgainBeforeItMakesATile) {
  const auto built = build_text(head + cards("spotted"));
  const OpacityCache cache(*built.scene, 1 << 20);
  for (int i = 0; i < 3; ++i) cached(cache, hit_at(0.5f, 0.25f, width_of(5)));
  EXPECT_EQ(cache.state().counts.fills, 0u);
  for (int i = 0; i < 7; ++i) cached(cache, hit_at(0.5f, 0.25f, width_of(5)));
  EXPECT_EQ(cache.state().counts.fills, 1u);
  EXPECT_EQ(cache.state().counts.hits, 5u);
}

// All that bears a pattern of u and v shares its tiles, and so do instances of any pattern; other primitives do not.
TEST(OpacityCache, IsNamedByWhatTheOpacityDependsOn) {
  for (const bool plane : {true, false}) {
    const auto built = build_text(head + cards(plane ? "ragged" : "spotted"));
    const OpacityCache cache(*built.scene, 1 << 20);
    OpacityTest::Hit hit = hit_at(0.5f, 0.25f, width_of(6));
    for (int i = 0; i < 10; ++i) cached(cache, hit);
    const uint64_t fills = cache.state().counts.fills, lookups = cache.state().counts.lookups,
                   hits = cache.state().counts.hits;
    hit.primitive = 2;  // the next card's first half
    cached(cache, hit);
    EXPECT_EQ(cache.state().counts.lookups, lookups + 1);
    EXPECT_EQ(cache.state().counts.hits, hits + (plane ? 1 : 0));
    EXPECT_EQ(cache.state().counts.fills, fills);
  }
}

TEST(OpacityCache, LeavesAloneWhatChangesInTime) {
  const char* moving =
      "Shape \"trianglemesh\" \"point3 P\" [ 0 0 1  1 0 1  1 1 1 ] \"point2 uv\" [ 0 0  1 0  1 1 ] \"integer indices\" "
      "[ 0 1 2 ] \"texture alpha\" \"spotted\"\n";
  const auto built =
      build_text(std::string(head) + "ActiveTransform EndTime Translate 0 0 3 ActiveTransform All\n" + moving);
  const OpacityCache cache(*built.scene, 1 << 20);
  // A shape that moves as a whole is an object with its own space: that is cached.
  for (int i = 0; i < 10; ++i) cached(cache, hit_at(0.5f, 0.25f, width_of(5)));
  EXPECT_GT(cache.state().counts.hits, 0u);

  scene::Scene scene;
  auto mesh = std::make_shared<geom::Mesh>();
  mesh->P = {V3f(0, 0, 0), V3f(1, 0, 0), V3f(0, 1, 0)};
  mesh->P_end = {V3f(0, 0, 1), V3f(1, 0, 1), V3f(0, 1, 1)};
  mesh->indices = {0, 1, 2};
  scene.traced.add(trace::MeshPtr(mesh), trace::CutOut::gray);
  scene.bindings.resize(1);
  scene.bindings[0].alpha = built.scene->bindings[card_geometry].alpha;
  const OpacityCache deforming(scene, 1 << 20);
  for (int i = 0; i < 10; ++i) {
    const OpacityTest::Hit hit{0, 0, 0.25f, 0.25f, float(i) / 10, width_of(5), 1};
    EXPECT_EQ(cached(deforming, hit), direct(scene, hit));
  }
  EXPECT_EQ(deforming.state().counts.lookups, 0u);
}

// One cap for all: opacity's share is taken from the others'. There is no cache where nothing is cut out, or where it
// is turned off.
TEST(OpacityCache, IsPartOfTheCap) {
  const auto leaves = build_text(head + cards("ragged")), nothing = build_text(head);
  build::IntegratorRequest request;
  request.type = "distribution";
  request.radiosity_cache = true;
  request.cache_mb = 3.0f;
  EXPECT_FALSE(build::make_opacity_cache(*nothing.scene, request));
  for (const bool on : {true, false}) {
    request.opacity_cache = on;
    const auto cache = build::make_opacity_cache(*leaves.scene, request);
    ASSERT_EQ(bool(cache), on);
    const auto integrator = build::make_integrator(*leaves.scene, request, 16, 0);
    uint64_t all = cache ? cache->state().capacity_bytes : 0;
    for (const auto& state : integrator->caches())
      if (state.name.starts_with("radiosity") || state.name == "hemispheres") all += state.capacity_bytes;
    EXPECT_LE(all, 3u << 20);
    EXPECT_GT(all, 3u << 19);
  }
}

/// A shader with an opacity stage of its own, that counts the points it is asked for.
class Holes final : public shading::Material {
 public:
  shading::StageSet stages() const override { return {shading::Stage::opacity, shading::Stage::prelighting}; }
  void opacity(const pattern::ShadingPoints& points, RGB* Oi) const override {
    asked += points.count;
    for (int i = 0; i < points.count; ++i) Oi[i] = RGB(length(points.P[i] - V3f(0, 0, 1)) < 0.9f ? 1.0f : 0.0f);
  }
  void prelighting(const pattern::ShadingPoints& points, scattering::Bsdf* out) const override {
    std::fill_n(out, points.count, scattering::Bsdf::make_diffuse(RGB(0.5f)));
  }
  bool needs_differentials() const override { return false; }
  mutable std::atomic<int> asked{0};
};

TEST(OpacityCache, SparesTheOpacityStagesOfShaders) {
  const auto built = build_text(head + cards("v"));
  const auto shader = std::make_shared<Holes>();
  built.scene->bindings[card_geometry].alpha =
      std::make_shared<shading::MeanTexture>(std::make_shared<shading::OpacityTexture>(shader, nullptr, nullptr));
  const auto without = render_built(built, 64, test::bounces(1));
  const int asked = shader->asked.exchange(0);
  const OpacityCache cache(*built.scene, 1 << 20);
  const auto with = render_built(built, 64, test::bounces(1));
  test::expect_near(with.mean(), without.mean(), 0.005f, "with the cache");
  EXPECT_LT(shader->asked * 3, asked);
}

/// Whole renders of each kind, of leaves of each kind.
struct Render {
  const char* integrator;
  const char* alpha;
};

class WholeRender : public testing::TestWithParam<Render> {
 protected:
  test::RenderedText render(const build::BuiltScene& built) const {
    if (GetParam().integrator == std::string("ao")) {
      path::AmbientOcclusion::Settings s;
      s.rays = 4;
      return render_built(built, 16, path::AmbientOcclusion(*built.scene, s));
    }
    if (GetParam().integrator == std::string("path")) return render_built(built, 16, test::bounces(2));
    distribution::DistributionIntegrator::Settings s;
    s.shading.bounces = 1;
    s.shading.shadow_rays = integrate::RayList{4};
    s.shading.diffuse_rays = integrate::RayList{8};
    return render_built(built, 16, s);
  }
};

TEST_P(WholeRender, IsThatWithoutTheCache) {
  const auto built = build_text(head + cards(GetParam().alpha));
  const auto without = render(built);
  const auto opaque = render(build_text(head + cards("u")));
  const OpacityCache cache(*built.scene, 1 << 20);
  const auto with = render(built);
  test::expect_near(with.mean(), without.mean(), 0.005f, "with the cache");
  EXPECT_FALSE(same_bits(with.film, opaque.film));
  EXPECT_GT(cache.state().counts.hits, 10 * cache.state().counts.fills);
  EXPECT_GT(cache.state().counts.fills, 0u);
}

TEST_P(WholeRender, IsTheSameForAnyThreadsAndSizes) {
  const auto built = build_text(head + cards(GetParam().alpha));
  std::optional<test::RenderedText> first;
  for (const int threads : {1, 2, 4})
    for (const size_t bytes : {size_t(1) << 22, size_t(20000), size_t(0)}) {
      set_thread_count(threads);
      const OpacityCache cache(*built.scene, bytes);
      auto r = render(built);
      if (!first) {
        first.emplace(std::move(r));
        continue;
      }
      EXPECT_TRUE(same_bits(first->film, r.film)) << threads << " threads, " << bytes << " bytes";
    }
  set_thread_count(0);
}

INSTANTIATE_TEST_SUITE_P(Kinds, WholeRender,
                         testing::Values(Render{"path", "ragged"}, Render{"path", "spotted"},
                                         Render{"distribution", "ragged"}, Render{"distribution", "spotted"},
                                         Render{"ao", "ragged"}, Render{"ao", "spotted"},
                                         Render{"path", "tint in plane"}, Render{"distribution", "tint in space"},
                                         Render{"ao", "tint in plane"}),
                         [](const auto& test) {
                           std::string name = std::string(test.param.integrator) + "_" + test.param.alpha;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

}  // namespace
}  // namespace dapple
