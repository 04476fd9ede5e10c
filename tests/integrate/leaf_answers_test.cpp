// SPDX-License-Identifier: Apache-2.0
// Paths whose diffuse rays end in a canopy's solution where they meet leaves, against paths that go on.
#include "dapple/build/leaf_answers.h"

#include <gtest/gtest.h>

#include "dapple/base/parallel.h"
#include "dapple/build/integrator_factory.h"
#include "tests/support/test_stand.h"

namespace dapple {
namespace {

using test::built;
using test::Stand;

path::PathIntegrator::Settings answered(const build::BuiltScene& scene, int bounces, int samples) {
  path::PathIntegrator::Settings s = test::bounces(bounces);
  build::IntegratorRequest request;
  request.leaf_answers = true;
  s.leaf_answers = build::make_leaf_answers(*scene.scene, request, path::PathIntegrator(*scene.scene, s), samples, {});
  return s;
}

uint64_t rays(const test::RenderedText& r) {
  return r.result.rays.diffuse + r.result.rays.shadow;
}

// Rationale: factors bring what leaves get to the mean of paths, of as many bounces, in crowns, where the solution
// alone is off by a tenth, and where it counts bounces that nobody asked for: of a near infrared of albedo .9 one
// bounce is a third of the light that was scattered. Expectation: with one, two and six bounces the mean of each
// channel is within 2.5 % of path tracing, whose own noise is .5 %; with six, a third fewer rays.
TEST(LeafAnswers, KeepTheMeanOfPaths) {
  Stand stand;
  stand.clumps = 12;
  const build::BuiltScene scene = built(stand);
  for (const int bounces : {1, 2, 6}) {
    const auto settings = answered(scene, bounces, 1024);
    ASSERT_TRUE(settings.leaf_answers);
    const test::RenderedText paths = test::render_built(scene, 128, test::bounces(bounces)),
                             ended = test::render_built(scene, 128, settings);
    test::expect_near(ended.mean(), paths.mean(), 0.025f, std::to_string(bounces).c_str());
    if (bounces == 6) {
      EXPECT_LT(double(rays(ended)), 0.67 * double(rays(paths)));
    }
  }
}

// Nothing but light that leaves had scattered is answered. Expectation: with black leaves the image is that of paths
// without bounces at leaves, and with a bounce none is taken away at the ground: means within 1 %.
TEST(LeafAnswers, AnswerNothingForBlackLeaves) {
  Stand stand;
  stand.optics = R"("rgb reflectance" [ 0 0 0 ] "rgb transmittance" [ 1e-12 1e-12 1e-12 ])";
  stand.ground = "[ .5 .5 .5 ]";
  const build::BuiltScene scene = built(stand);
  test::expect_near(test::render_built(scene, 64, answered(scene, 3, 64)).mean(),
                    test::render_built(scene, 64, test::bounces(3)).mean(), 0.01f, "black leaves");
}

// Rationale: light shafts by scan planes take up a path again where haze scattered it, with the same sum; what it
// brings then is none of the leaf's that it met before. Expectation: the mean of paths that go on within 2 %. It was 18
// % off.
TEST(LeafAnswers, BesideScanPlanes) {
  const std::string text =
      "MakeNamedMedium \"haze\" \"string type\" \"exponential\" \"float scaleheight\" 6 \"rgb sigma_a\" [ 0 0 0 ] "
      "\"rgb sigma_s\" [ .06 .06 .06 ]\nMediumInterface \"\" \"haze\"\n" +
      test::text_of({.clumps = 12, .camera = "LookAt 0 -3 1  0 0 1  0 0 1"});
  const build::BuiltScene scene = test::build_text(text);
  build::IntegratorRequest request = scene.request;
  request.type = "path";
  request.bounces = 4;
  request.shafts.shafts = "scan-planes";
  const auto mean = [&](bool ends) {
    request.leaf_answers = ends;
    return test::render_built(scene, 64, *build::make_integrator(*scene.scene, request, 64, 0)).mean();
  };
  test::expect_near(mean(true), mean(false), 0.02f, "haze");
}

// Rationale: shadow rays do not find what a smooth coat mirrors of the sky. Expectation: leaves with one go on, and so
// the mean stays within half a percent, of which a hundredth was lost.
TEST(LeafAnswers, LeaveCoatedLeavesAlone) {
  Stand stand;
  stand.lights = "LightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\n";
  std::string text = test::text_of(stand);
  const std::string plain = "Material \"diffusetransmission\" ";
  text.replace(text.find(plain), plain.size(),
               "Material \"openpbr\" \"bool geometry_thin_walled\" true \"float subsurface_weight\" .8 \"float "
               "specular_roughness\" 0 \"rgb subsurface_color\" [ .2 .4 .1 ] #");
  text.replace(text.find("#" + stand.optics), 1 + stand.optics.size(), "");
  build::BuildOptions options;
  options.period = Imath::Box2d(Imath::V2d(-test::half_width), Imath::V2d(test::half_width));
  const build::BuiltScene scene = test::build_text(text, options);
  const auto settings = answered(scene, 4, 256);
  test::expect_near(test::render_built(scene, 256, settings).mean(),
                    test::render_built(scene, 256, test::bounces(4)).mean(), 0.005f, "coated");
}

TEST(LeafAnswers, AreTheSameForAnyNumberOfThreads) {
  Stand stand;
  stand.clumps = 12;
  const build::BuiltScene scene = built(stand);
  set_thread_count(1);
  const scene::Film one = test::render_built(scene, 2, answered(scene, 4, 64)).film;
  for (const int threads : {2, 4}) {
    set_thread_count(threads);
    EXPECT_TRUE(test::same_bits(one, test::render_built(scene, 2, answered(scene, 4, 64)).film)) << threads;
  }
  set_thread_count(0);
}

// Rationale: nobody has to ask, so what may be wrong is left alone. Expectation: without a request none where the image
// is small; in a large one of dark leaves there are answers, in one of a near infrared, where a quarter of all light
// hangs on them and few paths have looked, there are none. Whoever asks gets them, but where there is no canopy, or
// where lamps stand, of which the solution knows nothing.
TEST(LeafAnswers, AreGivenWhereTheyAreRight) {
  const auto answers = [](const Stand& stand, std::optional<bool> asked, int samples) {
    const build::BuiltScene scene = built(stand);
    const path::PathIntegrator paths(*scene.scene, test::bounces(4));
    build::IntegratorRequest request;
    request.leaf_answers = asked;
    return build::make_leaf_answers(*scene.scene, request, paths, samples, {}) != nullptr;
  };
  Stand green, infrared, lamp, groups, bare;
  green.optics = R"("rgb reflectance" [ .05 .11 .04 ] "rgb transmittance" [ .04 .10 .02 ])";
  infrared.optics = R"("rgb reflectance" [ .45 .45 .45 ] "rgb transmittance" [ .45 .45 .45 ])";
  infrared.clumps = 12;
  lamp.lights += "LightSource \"point\" \"rgb I\" [ 1 1 1 ] \"point3 from\" [ 0 0 5 ]\n";
  groups.lights += "LightSource \"infinite\" \"rgb L\" [ .1 .1 .1 ] \"string group\" \"fill\"\n";
  bare.optics = R"("rgb reflectance" [ .4 .4 .4 ] "rgb transmittance" [ 0 0 0 ])";
  constexpr int many = 2048;  // of 48 x 48 pixels
  EXPECT_FALSE(answers(green, {}, 16));
  EXPECT_TRUE(answers(green, {}, many));
  EXPECT_FALSE(answers(green, false, many));
  EXPECT_TRUE(answers(green, true, 16));
  EXPECT_FALSE(answers(infrared, {}, 512));
  EXPECT_TRUE(answers(infrared, true, 512));
  EXPECT_FALSE(answers(lamp, true, many));
  EXPECT_FALSE(answers(groups, true, many));
  EXPECT_FALSE(answers(bare, true, many));
}

// The default integrator, and path tracing that is asked.
TEST(LeafAnswers, OfIntegrators) {
  const build::BuiltScene scene = built({});
  const auto ends = [&](const std::string& type, std::optional<bool> asked) {
    build::IntegratorRequest request = scene.request;
    request.type = type;
    request.bounces = 4;
    request.leaf_answers = asked;
    const auto made = build::make_integrator(*scene.scene, request, 16, 0);
    const auto* paths = dynamic_cast<const path::PathIntegrator*>(made.get());
    return paths && paths->leaf_answers() != nullptr;
  };
  EXPECT_TRUE(ends("path", true));
  EXPECT_FALSE(ends("path", {}));
  EXPECT_TRUE(ends("distribution", true));
  EXPECT_FALSE(ends("distribution", false));
}

}  // namespace
}  // namespace dapple
