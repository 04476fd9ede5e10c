// SPDX-License-Identifier: Apache-2.0
// Light shafts by scan planes against the rays that they stand for.
#include <gtest/gtest.h>

#include "dapple/base/parallel.h"
#include "tests/integrate/shaft_scenes.h"

namespace dapple {
namespace {

using namespace shaft_scenes;
using test::render_built;
using test::same_bits;

struct Case {
  const char* name;
  Parts parts;
};
void PrintTo(const Case& c, std::ostream* out) {
  *out << c.name;
}

class LightShafts : public testing::TestWithParam<Case> {};

// Rationale: planes only change how light is found, with all further scatterings. Expectation: equal means of blocks
// with multiple scattering: of 36 numbers none beyond 4.2 standard errors (1e-3 of all 36, Sidak), with .5 % for the
// width of bins and planes; and less noise.
TEST_P(LightShafts, HaveTheExpectationOfRays) {
  const auto built = build_text(hazy_scene(GetParam().parts));
  auto settings = paths(4);
  const auto rays = render_built(built, 256, settings);
  settings.shafts = planes_of(built);
  ASSERT_TRUE(settings.shafts);
  const auto planes = render_built(built, 64, settings);
  EXPECT_LT(worst_z(rays.film, planes.film, 0.005), 4.2);
  EXPECT_EQ(planes.film.dropped_samples(), 0u);
}

INSTANTIATE_TEST_SUITE_P(
    All, LightShafts,
    testing::Values(
        Case{"layered_sun", {.lights = std::string(sun) + sky}}, Case{"layered_disc", {.lights = disc}},
        Case{"box_sun", {.medium = homogeneous, .lights = sun, .bounded = true}},
        Case{"layered_box", {.lights = std::string(sun) + sky, .bounded = true}},
        Case{"layered_disc_and_lamp", {.lights = std::string(disc) + area}},
        Case{"orthographic", {.camera = orthographic, .lights = std::string(sun) + sky}},
        Case{"orthographic_box", {.camera = orthographic, .medium = homogeneous, .lights = sun, .bounded = true}},
        Case{"clumps_sun", {.medium = clumps(), .lights = std::string(sun) + sky}},
        Case{"clumps_spot_box", {.medium = clumps(), .lights = std::string(spot) + sun, .bounded = true}},
        Case{"clumps_disc", {.medium = clumps(), .lights = disc}},
        Case{"pattern_box", {.medium = windy, .lights = disc, .textures = wind, .bounded = true}},
        Case{"cloud", {.medium = cloud, .lights = std::string(sun) + sky}},
        Case{"orthographic_clumps", {.camera = orthographic, .medium = clumps(), .lights = sun}},
        Case{"orthographic_clumps_box", {.camera = orthographic, .medium = clumps(), .lights = sun, .bounded = true}},
        Case{"orthographic_spot", {.camera = orthographic, .medium = homogeneous, .lights = spot}},
        Case{"orthographic_layered_spot_box",
             {.camera = orthographic, .lights = std::string(spot) + sun, .bounded = true}},
        Case{"orthographic_clumps_spot", {.camera = orthographic, .medium = clumps(), .lights = spot}},
        Case{"spot", {.medium = homogeneous, .lights = spot}},
        Case{"layered_spot_box", {.lights = std::string(spot) + sun, .bounded = true}}),
    [](const auto& test) { return std::string(test.param.name); });

// Rationale: the default integrator takes the same planes. Expectation: its mean is the path tracer's within 1.5 %, of
// which noise is a third.
TEST(LightShaftsOfDistribution, HaveTheMeanOfPaths) {
  const auto built = build_text(hazy_scene({.lights = std::string(sun) + sky, .bounded = true}));
  auto reference = paths(4);
  reference.shafts = planes_of(built);
  const RGB expected = render_built(built, 128, reference).mean();
  distribution::DistributionIntegrator::Settings settings;
  settings.shading.shafts = reference.shafts;
  settings.shading.bounces = 3;
  test::expect_near(render_built(built, 64, settings).mean(), expected, 0.015f, "mean");
}

// Rationale: Max's picture: what is seen, weakened, and the sun's light in the air. Expectation: that of paths that
// scatter once, under the sun alone, by the Z-test above; with more light and scatterings to be had, less than all.
TEST(LightShaftsAlone, LeaveOutOtherLight) {
  const auto built = build_text(hazy_scene({.lights = std::string(sun) + sky}));
  auto settings = paths(4);
  settings.shafts = planes_of(built);
  const RGB all = render_built(built, 32, settings).mean();
  settings.shafts = planes_of(built, {.single = true});
  const RGB single = render_built(built, 32, settings).mean();
  EXPECT_LT(single.g, 0.99f * all.g);
  const auto sunny = build_text(hazy_scene({.lights = sun, .bounded = true}));
  auto once = paths(1);
  const auto rays = render_built(sunny, 256, once);
  once.shafts = planes_of(sunny, {.single = true});
  EXPECT_LT(worst_z(rays.film, render_built(sunny, 64, once).film, 0.005), 4.2);
}

// Expectation: the same bits for any threads and crop.
TEST(LightShaftsAlone, AreTheSameForThreadsAndCrop) {
  const auto built = build_text(hazy_scene({.lights = std::string(disc) + spot, .bounded = true}));
  const auto render = [&](int threads) {
    set_thread_count(threads);
    auto settings = paths(3);
    settings.shafts = planes_of(built);
    auto r = render_built(built, 4, settings);
    set_thread_count(0);
    return r;
  };
  const auto one = render(1), three = render(3);
  EXPECT_TRUE(same_bits(one.film, three.film));
  scene::Film::Settings part = built.scene->film;
  part.crop = {V2i(9, 5), V2i(21, 18)};
  scene::Film crop(part);
  auto settings = paths(3);
  settings.shafts = planes_of(built);
  const path::PathIntegrator integrator(*built.scene, settings);
  const std::atomic<bool> interrupt{false};
  render::RenderSession(integrator, crop, {.pixel_samples = 4}).run(interrupt);
  for (int y = part.crop.min.y; y < part.crop.max.y; ++y)
    for (int x = part.crop.min.x; x < part.crop.max.x; ++x)
      EXPECT_TRUE(crop.pixel(x, y) == one.film.pixel(x, y)) << x << ' ' << y;
}

/// A film that keeps what the air does.
template <class Integrator>
test::RenderedText render_with_air(const build::BuiltScene& built, int samples, const Integrator& integrator) {
  scene::Film::Settings film = built.scene->film;
  film.air = true;
  test::RenderedText r{scene::Film(film), {}};
  const std::atomic<bool> interrupt{false};
  r.result = render::RenderSession(integrator, r.film, {.pixel_samples = uint32_t(samples)}).run(interrupt);
  return r;
}

// Rationale: a black wall 4 m ahead in even fog, lit by a lamp at the side. Expectation: all there is is light in the
// air, so the picture and its part are the same numbers; of the wall e^-(sigma_t 4 / cos) is left, within 1e-4; one
// query a sample; and as nothing is left to draw, no shadow ray. In both integrators.
TEST(LightShaftsAlone, TellWhatTheAirDoes) {
  const auto built = build_text(R"(LookAt 0 0 0  0 1 0  0 0 1
MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_a" [ .01 .02 .03 ] "rgb sigma_s" [ .05 .05 .05 ]
MediumInterface "" "fog"
Camera "perspective" "float fov" 50
Film "rgb" "integer xresolution" 24 "integer yresolution" 16 "float iso" 50 PixelFilter "box"
WorldBegin
LightSource "point" "point3 from" [ 2 2 1 ] "rgb I" [ 6 5 4 ]
Material "diffuse" "rgb reflectance" [ 0 0 0 ]
Shape "bilinearmesh" "point3 P" [ -30 4 -30  30 4 -30  -30 4 30  30 4 30 ]
)");
  auto settings = paths(1);
  settings.shafts = planes_of(built);
  ASSERT_TRUE(settings.shafts);
  distribution::DistributionIntegrator::Settings cached;
  cached.shading.shafts = settings.shafts;
  cached.shading.bounces = cached.shading.specular_depth = 0;
  cached.pixel_samples = 2;
  const path::PathIntegrator path(*built.scene, settings);
  const distribution::DistributionIntegrator distribution(*built.scene, cached);
  for (const integrate::Integrator* integrator :
       {static_cast<const integrate::Integrator*>(&path), static_cast<const integrate::Integrator*>(&distribution)}) {
    const auto r = render_with_air(built, 2, *integrator);
    for (int y = 0; y < 16; ++y)
      for (int x = 0; x < 24; ++x) {
        const scene::AirFeatures air = r.film.air(x, y);
        const float px = (float(x) + 0.5f - 12) / 8, py = (8 - float(y) - 0.5f) / 8, t = std::tan(25 * pi / 180);
        const float length = 4 * std::sqrt(1 + sqr(px * t) + sqr(py * t));
        for (int c = 0; c < 3; ++c) {
          EXPECT_NEAR(r.film.pixel(x, y)[c], air.airlight[c], 1e-5f * air.airlight[c]);
          EXPECT_NEAR(air.transmittance[c], std::exp(-(0.06f + 0.01f * float(c)) * length), 6e-3f);
        }
        EXPECT_GT(air.airlight.min(), 0);
      }
    EXPECT_EQ(r.result.shafts.queries, uint64_t(24 * 16 * 2));
    EXPECT_GT(r.result.shafts.query_seconds, 0);
    EXPECT_EQ(r.result.shaft_tables.lights, 1);
    EXPECT_EQ(r.result.shaft_tables.rays, uint64_t(r.result.shaft_tables.planes) * 1024u);
    EXPECT_EQ(r.result.rays.shadow, 0u);
  }
}

// Rationale: what the air adds is a part of the picture, in the scale of its film. Expectation: with one scattering,
// pictures without surfaces' light and light in the air add up.
TEST(LightShaftsAlone, AirAndSurfacesAddUp) {
  const auto built = build_text(hazy_scene({.lights = disc}));
  auto settings = paths(1);
  settings.shafts = planes_of(built, {.single = true});
  const auto with = render_with_air(built, 4, path::PathIntegrator(*built.scene, settings));
  double air = 0, all = 0;
  for (int y = 0; y < 24; ++y)
    for (int x = 0; x < 32; ++x) {
      const RGB L = with.film.pixel(x, y), in_air = with.film.air(x, y).airlight;
      for (int c = 0; c < 3; ++c) EXPECT_LE(in_air[c], L[c] * (1 + 1e-5f));
      air += double(in_air.g), all += double(L.g);
    }
  EXPECT_GT(air, 0.05 * all);
  EXPECT_LT(air, 0.95 * all);
}

// Expectation: without a light that planes are for none are made, and where they do not apply it is said why.
TEST(LightShaftsAlone, SayWhyTheyDoNotApply) {
  const auto why = [](const Parts& parts) {
    std::string text;
    const auto built = build_text(hazy_scene(parts));
    EXPECT_FALSE(planes_of(built, {}, &text));
    return text;
  };
  EXPECT_NE(why({.lights = sky}).find("no sun"), std::string::npos);
  EXPECT_NE(why({.camera = "Camera \"perspective\" \"float lensradius\" .1\n", .lights = sun}).find("lens"),
            std::string::npos);
  EXPECT_NE(why({.medium = R"("string type" "homogeneous" "float scale" 0)", .lights = sun}).find("no medium scatters"),
            std::string::npos);
}

// Rationale: smoke that only absorbs stands in haze. Expectation: it is no second medium that scatters, whatever its
// kind.
TEST(LightShaftsAlone, KnowWhatOnlyAbsorbs) {
  for (const std::string& smoke :
       {std::string(
            R"("string type" "uniformgrid" "integer nx" 2 "integer ny" 1 "integer nz" 1 "float density" [ 1 2 ])"),
        std::string(R"("string type" "pattern" "texture density" "wind" "float maxdensity" 2)")}) {
    const auto text = [&](const char* scattering) {
      return hazy_scene({.lights = sun}) + wind + "MakeNamedMedium \"smoke\" " + smoke +
             " \"rgb sigma_a\" [ .1 .1 .1 ] \"rgb sigma_s\" [ " + scattering +
             " ]\nMaterial \"interface\" MediumInterface \"smoke\" \"haze\"\nTranslate 0 3 1 Shape \"sphere\"\n";
    };
    std::string why;
    EXPECT_FALSE(planes_of(build_text(text(".1 .1 .1")), {}, &why));
    EXPECT_NE(why.find("several media"), std::string::npos) << why;
    why.clear();
    // It dims what reaches the haze through it, which planes do not know; but it is no second medium that shines.
    EXPECT_FALSE(planes_of(build_text(text("0 0 0")), {}, &why));
    EXPECT_NE(why.find("through another medium"), std::string::npos) << why;
  }
}

// Expectation: tables stay within the memory that they may take, and that is said.
TEST(LightShaftsAlone, KeepToTheirMemory) {
  const auto built = build_text(hazy_scene({.lights = disc}));
  std::string why;
  std::vector<std::string> left;
  const auto small = light::make_shaft_light(*built.scene, {.max_bytes = 300000}, &why, &left);
  ASSERT_TRUE(small);
  EXPECT_LE(small->tables().bytes, 300000u);
  ASSERT_EQ(left.size(), 1u);
  EXPECT_NE(left[0].find("--shaft-mb"), std::string::npos);
  EXPECT_GT(planes_of(built)->tables().bytes, 300000u);
}

// Rationale: a sun at infinity behind an endless even fog. Expectation: black as with rays, and a hint.
TEST(LightShaftsAlone, NameTheRemedyForEndlessFog) {
  const auto built = build_text(hazy_scene({.medium = homogeneous, .lights = sun}));
  std::string why;
  std::vector<std::string> left;
  ASSERT_TRUE(light::make_shaft_light(*built.scene, {}, &why, &left));
  ASSERT_EQ(left.size(), 1u);
  EXPECT_NE(left[0].find("exponential"), std::string::npos);
}

}  // namespace
}  // namespace dapple
