// SPDX-License-Identifier: Apache-2.0
// Integrator "canopy" against path tracing of the same leaves.
#include "dapple/vegetation/canopy_transport.h"

#include <gtest/gtest.h>

#include "dapple/base/parallel.h"
#include "tests/support/test_stand.h"

namespace dapple {
namespace {

using test::built;
using test::Stand;

path::PathIntegrator::Settings canopy_settings(const build::BuiltScene& scene, bool gather, int bounces = 0) {
  path::PathIntegrator::Settings s = test::bounces(bounces);
  s.canopy = std::make_shared<const vegetation::CanopyTransport>(*scene.scene, vegetation::CanopyTransport::Settings());
  s.canopy_gather = gather;
  return s;
}

// Light scattered at least once, total - direct, against path tracing: with the solution at visible surfaces, and at
// the ends of rays.
void expect_scattered(const build::BuiltScene& scene, float tabulated, float gathered) {
  const RGB direct = test::render_built(scene, 64, test::bounces(0)).mean(),
            total = test::render_built(scene, 64, test::bounces(64)).mean();
  for (const bool gather : {false, true}) {
    const char* what = gather ? "gathered" : "tabulated";
    const RGB scattered = test::render_built(scene, 64, canopy_settings(scene, gather)).mean() - direct;
    test::expect_near(scattered, total - direct, gather ? gathered : tabulated, what);
    for (int c = 0; c < 3; ++c)
      testing::Test::RecordProperty(what + std::to_string(c), std::to_string(scattered[c] / (total - direct)[c] - 1));
  }
}

// Rationale: leaves at random, small against the canopy, are what plane-parallel transport is about (5.9, test 15), and
// seen from inside no leaf is special. Expectation: light scattered at least once, total - direct, within 4 % of path
// tracing in red, green and a near infrared of albedo .9, tabulated; 3 % gathered, which is right to first order. (2 %
// each were seen: leaves of .06 in 2 m shade and light their neighbours a little, and there is noise of 1 %.)
TEST(CanopyTransport, LeavesAtRandomAreLitAsByPathTracing) {
  expect_scattered(built({}), 0.04f, 0.03f);
}

// The same from above, at a slant: the ground and the tops of leaves.
TEST(CanopyTransport, LeavesAtRandomFromAbove) {
  Stand stand;
  stand.camera = "LookAt 0 0 9  4 3 0  0 0 1";
  expect_scattered(built(stand), 0.04f, 0.03f);
}

// Rationale: a clear sky is brightest around the sun, low in one direction: its cosine and sine modes count, and zenith
// angles. Expectation: as before.
TEST(CanopyTransport, LeavesAtRandomUnderAClearSky) {
  Stand stand;
  stand.lights =
      "LightSource \"sky\" \"float skyirradiance\" 3 \"string skymodel\" \"clear\" \"float sunzenith\" 65 \"float "
      "sunazimuth\" 130\n";
  expect_scattered(built(stand), 0.05f, 0.03f);
}

// Rationale: gaps between balls of leaves are what clumping measures, and recollision is what it does to scattered
// light; without them tabulated light is 2.3 times too bright in red and 19 % off gathered. Expectation: Omega is 1
// within 8 % for leaves at random, and below .75 in balls; there the light scattered is within 25 % of path tracing
// tabulated, and 12 % gathered.
TEST(CanopyTransport, Clumps) {
  const auto omega = [](const build::BuiltScene& scene) {
    const auto c = vegetation::CanopyTransport(*scene.scene, {}).clumping();
    double sum = 0;
    for (size_t s = 6; s < 14; ++s) sum += (c.above[s] + c.below[s]) / 16;
    return sum;
  };
  EXPECT_NEAR(omega(built({})), 1, 0.08);
  Stand stand;
  stand.clumps = 12;
  const build::BuiltScene scene = built(stand);
  EXPECT_LT(omega(scene), 0.75);
  expect_scattered(scene, 0.25f, 0.12f);
}

// Rationale: in a furnace, surfaces that absorb nothing under a uniform sky of radiance 1, radiance is 1 everywhere.
// Leaves at random keep it by the solver's energy fix, what light is scattered by clumps by their albedo, which is
// then 1. Expectation: 1 within 3 %.
TEST(CanopyTransport, FurnaceIsWhite) {
  Stand stand;
  stand.lights = "LightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\n";
  stand.optics = R"("rgb reflectance" [ .5 .3 .8 ] "rgb transmittance" [ .5 .7 .2 ])";
  stand.ground = "[ 1 1 1 ]";
  const build::BuiltScene scene = built(stand);
  for (const bool gather : {false, true})
    test::expect_near(test::render_built(scene, 64, canopy_settings(scene, gather)).mean(), 1, 0.03f,
                      gather ? "gathered" : "tabulated");
}

// Rationale: what black leaves get from the ground they keep. Expectation: the path tracer's direct light, to the
// rounding of what the solution subtracts from skylight, and the 1e-12 that leaves transmit here so as to be leaves.
TEST(CanopyTransport, BlackLeavesGiveDirectLight) {
  Stand stand;
  stand.optics = R"("rgb reflectance" [ 0 0 0 ] "rgb transmittance" [ 1e-12 1e-12 1e-12 ])";
  stand.ground = "[ .5 .5 .5 ]";
  const build::BuiltScene scene = built(stand);
  const scene::Film direct = test::render_built(scene, 4, test::bounces(0)).film;
  for (const bool gather : {false, true}) {
    const scene::Film film = test::render_built(scene, 4, canopy_settings(scene, gather)).film;
    for (int y = 0; y < film.height(); ++y)
      for (int x = 0; x < film.width(); ++x)
        for (int c = 0; c < 3; ++c) ASSERT_NEAR(film.pixel(x, y)[c], direct.pixel(x, y)[c], 1e-5f);
  }
}

// Rationale: bounces followed by rays leave less to the solution. Expectation: with two of them half of the error that
// none may have.
TEST(CanopyTransport, BouncesConverge) {
  const build::BuiltScene scene = built({});
  const RGB direct = test::render_built(scene, 64, test::bounces(0)).mean(),
            total = test::render_built(scene, 64, test::bounces(64)).mean();
  test::expect_near(test::render_built(scene, 64, canopy_settings(scene, false, 2)).mean() - direct, total - direct,
                    0.03f, "two bounces");
}

TEST(CanopyTransport, IsTheSameForAnyNumberOfThreads) {
  Stand stand;
  stand.clumps = 12;
  const build::BuiltScene scene = built(stand);
  set_thread_count(1);
  const scene::Film one = test::render_built(scene, 2, canopy_settings(scene, true)).film;
  for (const int threads : {2, 4}) {
    set_thread_count(threads);
    EXPECT_TRUE(test::same_bits(one, test::render_built(scene, 2, canopy_settings(scene, true)).film)) << threads;
  }
  set_thread_count(0);
}

// An image sky: radiance depends on azimuth, so that both sine and cosine fields count. Two halves of a sky from a
// bitmap would need a file; a distant light close to the horizon on each side does the same to the solution.
TEST(CanopyTransport, AzimuthsOfSunsAreTheWorlds) {
  Stand stand;
  stand.lights = R"(LightSource "distant" "rgb L" [ 3 3 3 ] "point3 from" [ -1 0 .6 ] "point3 to" [ 0 0 0 ]
)";
  const build::BuiltScene scene = built(stand);
  const vegetation::CanopyTransport canopy(*scene.scene, {});
  const uint32_t leaves = 1;
  // Light from -x lights leaves that face -x, once scattered above all by what it hits on the +x side of them:
  // backscatter.
  const auto towards = canopy.scattered(leaves, V3f(0, 0, 1.9f), V3f(-1, 0, 0)),
             across = canopy.scattered(leaves, V3f(0, 0, 1.9f), V3f(0, 1, 0));
  EXPECT_NEAR(across.front.b, across.behind.b, 1e-3f * across.front.b);
  EXPECT_GT(std::abs(towards.front.r - towards.behind.r), 0.01f * towards.front.r);
}

std::string refusal(const std::string& integrator, const std::string& shape) {
  const std::string text = "Integrator \"canopy\" " + integrator +
                           "\nCamera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\nMakeNamedMaterial "
                           "\"litter\" \"string type\" \"diffuse\"\n" +
                           "Material \"diffusetransmission\"\n" + shape;
  try {
    const build::BuiltScene scene = test::build_text(text);
    build::make_integrator(*scene.scene, scene.request, 1, 0);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

TEST(CanopyTransport, BadParametersAreNamed) {
  const std::string leaf = "Shape \"disk\" \"float height\" 2\n";
  EXPECT_EQ(refusal("", leaf + "Material \"diffuse\" Shape \"disk\" \"float radius\" 9"), "");
  const auto expect = [](const std::string& message, const std::string& part) {
    EXPECT_NE(message.find("test.pbrt:1"), std::string::npos) << message;
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  expect(refusal("\"integer slabs\" 0", leaf), "slabs");
  expect(refusal("\"integer slabs\" 100000000", leaf), "slabs");
  expect(refusal("\"float plot\" [ 0 1 2 ]", leaf), "plot");
  expect(refusal("\"float plot\" [ 1 0 0 1 ]", leaf), "plot");
  expect(refusal("\"float plot\" [ 50 60 50 60 ]", leaf), "canopy");
  expect(refusal("\"string ground\" \"snow\"", leaf), "litter");
  expect(refusal("\"integer bounces\" -1", leaf), "bounces");
  expect(refusal("", "Material \"diffuse\" " + leaf), "transmits");
}

}  // namespace
}  // namespace dapple
