// SPDX-License-Identifier: Apache-2.0
// Shadow masks in place of shadow rays, against the rays that they stand for.
#include <gtest/gtest.h>

#include <filesystem>
#include <numeric>

#include "dapple/base/parallel.h"
#include "dapple/forest/sun_mask.h"
#include "dapple/integrate/camera_batch.h"
#include "dapple/integrate/ray_origin.h"
#include "dapple/vegetation/mask_scene.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

using distribution::DistributionIntegrator;
using test::build_text;
using test::render_built;
using test::same_bits;

std::shared_ptr<const forest::MaskVisibility> masks_of(const scene::Scene& scene, int levels, float pixel,
                                                       int sky = 0) {
  forest::MaskVisibility::Settings s;
  s.sun = {levels, pixel, 64};
  s.sky = {levels, 4 * pixel, 64};
  s.sky_directions = sky;
  return std::make_shared<forest::MaskVisibility>(vegetation::make_mask_scene(scene, size_t(1) << 30),
                                                  vegetation::narrow_beams(scene), s);
}

DistributionIntegrator::Settings direct_light(int shadow_rays) {
  DistributionIntegrator::Settings s;
  s.radiosity_cache = false;
  s.shading.bounces = 0;
  s.shading.shadow_rays = {shadow_rays};
  return s;
}

/// The ground from above, 4 m wide, under a sun 20 degrees off the zenith and whatever stands there; seen from below
/// it.
std::string ground(const std::string& things, const std::string& light) {
  return R"(LookAt 0 0 .5  0 0 0  0 1 0 Camera "orthographic" "float screenwindow" [ -2 2 -2 2 ]
Film "rgb" "integer xresolution" [ 64 ] "integer yresolution" [ 64 ] PixelFilter "box"
WorldBegin
)" + light +
         R"(
Material "diffuse" "rgb reflectance" [ .5 .5 .5 ]
Shape "bilinearmesh" "point3 P" [ -9 -9 0  9 -9 0  -9 9 0  9 9 0 ]
)" + things;
}
const std::string sun = R"(LightSource "sky" "float sunzenith" 20 "float sunazimuth" 30 "float sunirradiance" 6 )";

struct Thing {
  const char* name;
  const char* text;
  float block = 0.04f;
};
void PrintTo(const Thing& t, std::ostream* out) {
  *out << t.name;
}

class MaskedShapes : public testing::TestWithParam<Thing> {};

// Rationale: every kind of shape, cut-outs and instances become facets. Expectation: pictures lit by masks and by rays
// agree in their means to .3 % of the open ground's light, and in means of 8 x 8 pixels to 4 %: a block is .5 m wide,
// and an edge through it lies within some of the mask's pixels of 1 cm. Half-transparent ones to 12 %: a block has 49
// shading points, each of which sees some 6 pixels that are there or not at random, 4 standard errors of .49 /
// sqrt(294).
TEST_P(MaskedShapes, CastTheShadowsOfRays) {
  const auto built = build_text(ground(GetParam().text, sun));
  auto settings = direct_light(128);
  const auto rays = render_built(built, 4, settings);
  settings.masks = masks_of(*built.scene, 256, 0.01f);
  const auto masks = render_built(built, 4, settings);
  EXPECT_EQ(masks.result.rays.shadow, 0u);
  EXPECT_GT(masks.result.rays.mask, 1000u);
  const float open = 6 * std::cos(radians(20)) * 0.5f / pi;
  EXPECT_LT(rays.mean().g, 0.99f * open) << "no shadow at all";
  EXPECT_NEAR(masks.mean().g, rays.mean().g, 0.003f * open);
  for (int y = 0; y < 64; y += 8)
    for (int x = 0; x < 64; x += 8) {
      float a = 0, b = 0;
      for (int k = 0; k < 64; ++k)
        a += masks.film.pixel(x + k % 8, y + k / 8).g, b += rays.film.pixel(x + k % 8, y + k / 8).g;
      EXPECT_NEAR(a / 64, b / 64, GetParam().block * open) << x << ' ' << y;
    }
}

// Rationale: of a sun without extent the cosine of a margin rounds to 1, and a unit vector with itself to less.
// Expectation: masks answer all rays to it, from whichever direction it shines, and the means agree to .3 %.
TEST(Masks, ServeSunsWithoutExtent) {
  for (const char* from : {"2 1 4", "0 0 4", "-.7 1.3 2.9", "1 -2 3.3"}) {
    const auto built = build_text(
        ground("Translate 0 0 .2 Shape \"sphere\" \"float radius\" .2",
               "LightSource \"distant\" \"point3 from\" [ " + std::string(from) + " ] \"point3 to\" [ 0 0 0 ] "));
    auto settings = direct_light(16);
    const auto rays = render_built(built, 4, settings);
    settings.masks = masks_of(*built.scene, 256, 0.01f);
    const auto masks = render_built(built, 4, settings);
    EXPECT_EQ(masks.result.rays.shadow, 0u) << from;
    EXPECT_GT(masks.result.rays.mask, 1000u) << from;
    EXPECT_NEAR(masks.mean().g, rays.mean().g, 0.003f * 0.5f / pi) << from;
  }
}

// Rationale: haze without bounds above the ground, that absorbs, and that scatters too. Expectation: what masks let
// through is weakened as shadow rays are: the means agree to .3 %, with random flights to 2 % (their noise is .5 %).
TEST(MasksInHaze, WeakenLightAsRaysDo) {
  const std::string quad = R"(Shape "bilinearmesh" "point3 P" [ -1 -1 2  1 -1 3  -1 1 2  1 1 2.5 ])";
  const auto haze = [&](const std::string& scattering) {
    return R"(MakeNamedMedium "haze" "string type" "exponential" "float scaleheight" 4 "rgb sigma_a" [ .1 .2 .05 ] "rgb sigma_s" [ )" +
           scattering + " ]\nMediumInterface \"\" \"haze\"\n" + ground(quad, sun);
  };
  const float clear = render_built(build_text(ground(quad, sun)), 4, direct_light(64)).mean().g;
  for (const bool scatters : {false, true}) {
    const auto built = build_text(haze(scatters ? ".05 .05 .05" : "0 0 0"));
    auto settings = direct_light(64);
    const int samples = scatters ? 64 : 4;
    const RGB rays = render_built(built, samples, settings).mean();
    settings.masks = masks_of(*built.scene, 256, 0.01f);
    const auto masks = render_built(built, samples, settings);
    EXPECT_GT(masks.result.rays.mask, 1000u);
    EXPECT_LT(rays.g, 0.6f * clear);
    test::expect_near(masks.mean(), rays, scatters ? 0.02f : 0.003f, scatters ? "scattering" : "absorbing");
  }
}

/// A medium that absorbs, in shapes.
std::string absorbing(const std::string& name, const std::string& sigma) {
  return "MakeNamedMedium \"" + name + R"(" "string type" "homogeneous" "rgb sigma_s" [ 0 0 0 ] "rgb sigma_a" [ )" +
         sigma + " ]\n";
}
std::string border(const std::string& inside, const std::string& outside, const std::string& place, float radius) {
  return "AttributeBegin Material \"interface\" MediumInterface \"" + inside + "\" \"" + outside + "\" " + place +
         " Shape \"sphere\" \"float radius\" " + std::to_string(radius) + " AttributeEnd\n";
}

// Rationale: on its way to what masks shade, light passes media that end: a ball of haze, one in another, balls of an
// object that is placed twice, some behind what casts shadows. Expectation: as by rays, means to .3 %, blocks to 1 % of
// the light without media.
TEST(MasksInHaze, KnowWhereMediaEnd) {
  const std::string quad = R"(Shape "bilinearmesh" "point3 P" [ -1 -1 2  1 -1 3  -1 1 2  1 1 2.5 ])";
  const std::string media = absorbing("haze", ".8 .4 .2") + absorbing("core", "2 3 1");
  const std::string placed = "ObjectBegin \"ball\" " + border("haze", "", "", 0.6f) +
                             "ObjectEnd AttributeBegin Translate -.6 .5 1.8 Scale 1 1 2 ObjectInstance \"ball\" "
                             "AttributeEnd AttributeBegin Translate 1 -.8 3.9 ObjectInstance \"ball\" AttributeEnd\n";
  const std::string cases[] = {
      border("haze", "", "Translate .5 0 1.6", 1),
      border("haze", "", "Translate 0 0 1.9", 1.3f) + border("core", "haze", "Translate .2 .1 1.6", 0.5f), placed};
  const float clear = render_built(build_text(ground(quad, sun)), 4, direct_light(64)).mean().g;
  for (const std::string& balls : cases) {
    const auto built = build_text(ground(media + quad + balls, sun));
    auto settings = direct_light(64);
    const auto rays = render_built(built, 4, settings);
    settings.masks = masks_of(*built.scene, 256, 0.01f);
    const auto masks = render_built(built, 4, settings);
    EXPECT_GT(masks.result.rays.mask, 1000u);
    EXPECT_EQ(masks.result.rays.shadow, 0u);
    EXPECT_LT(rays.mean().g, 0.985f * clear);
    float worst = 0;
    test::expect_near(masks.mean(), rays.mean(), 0.003f, balls.c_str());
    for (int y = 0; y < 64; y += 8)
      for (int x = 0; x < 64; x += 8) {
        float a = 0, b = 0;
        for (int k = 0; k < 64; ++k)
          a += masks.film.pixel(x + k % 8, y + k / 8).g, b += rays.film.pixel(x + k % 8, y + k / 8).g;
        worst = std::max(worst, std::abs(a - b) / 64 / clear);
      }
    EXPECT_LT(worst, 0.01f) << balls;
  }
}

// Rationale: such surfaces that are cut out cannot be told apart from their shapes. Expectation: masks are not asked.
TEST(MasksInHaze, AreNotAskedWhereBordersAreCutOut) {
  const std::string ball = R"(AttributeBegin Material "interface" MediumInterface "haze" "" Translate .5 0 1.4
Shape "sphere" "float radius" 1 "float alpha" .5 AttributeEnd)";
  const auto built = build_text(ground(absorbing("haze", ".8 .4 .2") + ball, sun));
  auto settings = direct_light(16);
  settings.masks = masks_of(*built.scene, 64, 0.05f);
  EXPECT_EQ(render_built(built, 1, settings).result.rays.mask, 0u);
}

INSTANTIATE_TEST_SUITE_P(
    All, MaskedShapes,
    testing::Values(
        Thing{"mesh", R"(Shape "trianglemesh" "point3 P" [ -1 -1 2  1 -1 3  0 1 2 ] "integer indices" [ 0 1 2 ])"},
        Thing{"quad", R"(Shape "bilinearmesh" "point3 P" [ -1 -1 2  1 -1 3  -1 1 2  1 1 2.5 ])"},
        Thing{"sphere", R"(Translate 0 0 2 Shape "sphere" "float radius" 0.7)"},
        Thing{
            "cylinder",
            R"(Translate 0 0 1.5 Rotate 70 1 1 0 Shape "cylinder" "float radius" 0.3 "float zmin" -1 "float zmax" 1)"},
        Thing{
            "curve",
            R"(Shape "curve" "string type" "cylinder" "point3 P" [ -1.5 -1 2  -1 1 3  1 -1 2  1.5 1 3 ] "float width" 0.2)",
            0.05f},  // both of its edges lie in one block
        Thing{
            "disks",
            R"(Shape "disks" "point3 P" [ -.8 0 2  .6 .5 3 ] "float radius" [ .5 .4 ] "normal N" [ 0 0 1  .6 0 .8 ])"},
        Thing{
            "subdivision",
            R"(Translate 0 0 2 Shape "catmullclark" "integer levels" 2 "point3 P" [ -1 -1 -.5 1 -1 -.5 1 1 -.5 -1 1 -.5 -1 -1 .5 1 -1 .5 1 1 .5 -1 1 .5 ]
             "integer vertices" [ 4 4 4 4 4 4 ] "integer indices" [ 0 3 2 1  4 5 6 7  0 1 5 4  1 2 6 5  2 3 7 6  3 0 4 7 ])"},
        Thing{"cut_out",
              R"(Texture "a" "float" "checkerboard" "float tex1" 0 "float tex2" 1 "float uscale" 4 "float vscale" 4
             Shape "bilinearmesh" "point3 P" [ -1 -1 2  1 -1 2  -1 1 2  1 1 2 ] "point2 uv" [ 0 0 1 0 0 1 1 1 ] "texture alpha" "a")"},
        Thing{"thin", R"(Shape "bilinearmesh" "point3 P" [ -1 -1 2  1 -1 2  -1 1 2  1 1 2 ] "float alpha" 0.4)", 0.12f},
        Thing{
            "instances",
            R"(ObjectBegin "o" Shape "sphere" "float radius" 0.3 Shape "trianglemesh" "point3 P" [ 0 0 0  1 0 .2  0 1 0 ] "integer indices" [ 0 1 2 ] ObjectEnd
             AttributeBegin Translate -.6 0 2 Rotate 40 0 1 1 Scale 1 1.5 .7 ObjectInstance "o" AttributeEnd
             AttributeBegin Translate .7 .4 3 Scale -1 1 1 ObjectInstance "o" AttributeEnd)"}),
    [](const auto& test) { return std::string(test.param.name); });

// Rationale: the path tracer uses the same masks. Expectation: the same bounds for a sphere's shadow by sun and sky,
// the sky's by maps of 256 directions.
TEST(Masks, ServeThePathTracerAndTheSky) {
  const auto built = build_text(ground(
      R"(Translate 0 0 1.5 Shape "sphere" "float radius" 0.7)",
      R"(LightSource "sky" "float sunzenith" 20 "float sunazimuth" 30 "float sunirradiance" 3 "float skyirradiance" 3)"));
  auto settings = test::bounces(0);
  const auto rays = render_built(built, 256, settings);
  settings.masks = masks_of(*built.scene, 128, 0.02f, 256);
  const auto masks = render_built(built, 256, settings);
  EXPECT_EQ(masks.result.rays.shadow, 0u);
  EXPECT_NEAR(masks.mean().g / rays.mean().g, 1, 0.01);
  ASSERT_EQ(masks.result.caches.size(), 1u);
  EXPECT_EQ(masks.result.caches[0].name, "masks");
  EXPECT_GT(masks.result.caches[0].counts.fills, 0u);
}

// Rationale: masks are made by whichever thread comes first. Expectation: the same image, bit for bit, with 1, 2 and 4
// threads, sky included.
TEST(Masks, DoNotDependOnThreads) {
  const auto built =
      build_text(ground(R"(Translate 0 0 1.5 Shape "sphere" "float radius" 0.7)",
                        R"(LightSource "sky" "float sunzenith" 20 "float sunirradiance" 3 "float skyirradiance" 3)"));
  std::optional<scene::Film> first;
  for (const int threads : {1, 2, 4}) {
    set_thread_count(threads);
    auto settings = direct_light(4);
    settings.masks = masks_of(*built.scene, 64, 0.02f, 64);
    auto r = render_built(built, 2, settings);
    if (!first)
      first.emplace(std::move(r.film));
    else
      EXPECT_TRUE(same_bits(*first, r.film)) << threads;
  }
  set_thread_count(0);
}

// Rationale: light from a lamp is not the masks' to tell. Expectation: its rays are traced.
TEST(Masks, LeaveLampsToRays) {
  const auto built = build_text(ground("", sun + R"(LightSource "point" "point3 from" [ 0 0 3 ] "rgb I" [ 1 1 1 ])"));
  auto settings = direct_light(4);
  settings.masks = masks_of(*built.scene, 64, 0.02f);
  const auto r = render_built(built, 1, settings);
  EXPECT_GT(r.result.rays.shadow, 0u);
  EXPECT_GT(r.result.rays.mask, 0u);
}

// Rationale: within one slab of traced shadow rays (illumination under trees, 4.7), on a tree cut out by alpha. What
// stands nearer than a receiver's own slabs does not shade it, so that visibility lies between that of rays from the
// receiver and that of rays from where its slabs end. Expectation: the mean over receivers does, to .01; and for nine
// receivers of ten their own, to a quarter, which the spread over a pixel moves at edges.
TEST(Masks, LieWithinASlabOfTracedRays) {
  const std::filesystem::path file = std::filesystem::path(DAPPLE_SHARED_DIR) / "scenes/forest/tree.pbrt";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is absent";
  Diagnostics diagnostics;
  build::BuildOptions options;
  options.film.resolution = V2i(96, 54);
  const build::BuiltScene built = build::load_scene(file.string(), options, diagnostics);
  const scene::Scene& scene = *built.scene;
  const float tangent = std::tan(radians(0.2665f));
  const forest::SunSamples samples(32, 16);
  const auto facets = vegetation::make_mask_scene(scene, size_t(1) << 30);
  forest::TileStore store(size_t(256) << 20);
  const forest::SlabMap map(*facets, vegetation::narrow_beams(scene).at(0).to_light, double(tangent), {256, 0.02f, 128},
                            store, 0);
  const forest::MaskFrame& frame = map.frame();

  std::vector<V3f> P, N;
  std::vector<float> error;
  std::vector<uint16_t> sets;
  integrate::CameraBatch camera;
  trace::RayBatch rays;
  trace::HitBatch hits;
  integrate::CameraBatch::for_each_block(scene.film.crop, [&](const Box2i& box) {
    camera.generate(scene, box, 0, PixelSets(1, 0));
    for (int p = 0; p < camera.count; ++p)
      rays.set(p, camera.ray[p].ray.o, camera.ray[p].ray.d, infinity, 0, uint32_t(p));
    scene.traced.intersect(rays, camera.count, &hits);
    for (int p = 0; p < camera.count; ++p) {
      if (hits.geometry[p] == trace::no_id) continue;
      const geom::SurfacePoint s = scene.traced.surface_without_tangents(rays, hits, p);
      P.push_back(s.P), N.push_back(s.Ng), error.push_back(s.error);
      sets.push_back(uint16_t(samples.set_of_pixel(camera.pixel[p].x, camera.pixel[p].y)));
    }
  });
  ASSERT_GT(P.size(), 1000u);
  std::vector<RGB> visible(P.size());
  forest::SunMask(map, double(tangent), samples).visibility(P, N, sets, visible);

  double mean = 0, least = 0, most = 0;
  size_t within = 0;
  for (size_t r = 0; r < P.size(); ++r) {
    const auto traced = [&](float start) {
      RGB passed[32];
      for (int i = 0; i < 32; ++i) {
        const V2f p = samples.point(sets[r], i) * tangent;
        const V3f d = normalize(frame.to_light + frame.x * p.x + frame.y * p.y);
        const V3f o = offset_origin(integrate::RayOrigin{P[r], N[r], V3f(0, 0, 0), error[r], 0}, d);
        rays.set(i, o + d * start, d, infinity, 0.5f, uint32_t(r * 32 + size_t(i)));
      }
      scene.traced.transmitted(rays, 32, passed);
      return double(std::accumulate(passed, passed + 32, RGB()).g) / 32;
    };
    const V2f slope = frame.slope(N[r]);
    const double near = traced(0), far = traced((0.5f * (std::abs(slope.x) + std::abs(slope.y)) + 1.5f) * frame.slab),
                 v = double(visible[r].g);
    mean += v, least += near, most += far;
    within += v >= std::min(near, far) - 0.25 && v <= std::max(near, far) + 0.25;
  }
  const double n = double(P.size());
  EXPECT_GE(mean / n, least / n - 0.01);
  EXPECT_LE(mean / n, most / n + 0.01);
  EXPECT_GT(double(within) / n, 0.9);
}

}  // namespace
}  // namespace dapple
