// SPDX-License-Identifier: Apache-2.0
// Pictures of objects in objects against the same flat, by all integrators.
#include <gtest/gtest.h>

#include "dapple/impostor/image_integrator.h"
#include "dapple/vegetation/canopy_sample.h"
#include "tests/support/nested_text.h"
#include "tests/support/render_text.h"
#include "tests/support/test_trees.h"

namespace dapple {
namespace {

using test::build_text;
using test::canopy_settings;
using test::expect_near;
using test::NestedText;
using test::render_built;
using test::wood_scene;

struct NestedPictures : testing::Test {
  const NestedText text;
  const build::BuiltScene nested = build_text(wood_scene(text.nested())), flat = build_text(wood_scene(text.flat()));
};

// The same rays meet the same, so that pictures differ where rounding parts them alone.
TEST_F(NestedPictures, OfPathsAreTheSame) {
  ASSERT_EQ(nested.scene->traced.instance_count(), text.paths());
  ASSERT_EQ(flat.scene->traced.instance_count(), text.paths());
  const auto a = render_built(nested, 16, test::bounces(4)), b = render_built(flat, 16, test::bounces(4));
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(a.mean()[c], b.mean()[c], 2e-3f * b.mean()[c]);
  int differ = 0;
  for (int y = 0; y < a.film.height(); ++y)
    for (int x = 0; x < a.film.width(); ++x)
      differ += std::abs(a.film.pixel(x, y).g - b.film.pixel(x, y).g) > 1e-3f * b.film.pixel(x, y).g;
  EXPECT_LT(differ, 48 * 32 / 20);
}

TEST(NestedCutOuts, AreLitAsFlatOnes) {
  const NestedText text("\"float alpha\" .6");
  const auto a = render_built(build_text(wood_scene(text.nested())), 64, test::bounces(2));
  const auto b = render_built(build_text(wood_scene(text.flat())), 64, test::bounces(2));
  expect_near(a.mean(), b.mean(), 0.01f, "cut-outs");
}

TEST_F(NestedPictures, OfDistributionAreAlike) {
  distribution::DistributionIntegrator::Settings s;
  s.shading.bounces = 2;
  const auto a = render_built(nested, 16, s), b = render_built(flat, 16, s);
  expect_near(a.mean(), b.mean(), 0.02f, "distribution");
}

TEST_F(NestedPictures, OfCanopiesAreAlike) {
  const auto a = render_built(nested, 16, canopy_settings(*nested.scene)),
             b = render_built(flat, 16, canopy_settings(*flat.scene));
  expect_near(a.mean(), b.mean(), 0.01f, "canopy");
}

// Leaf area is counted on every path.
TEST_F(NestedPictures, HaveTheLeavesOfFlatOnes) {
  vegetation::CanopySurveyOptions options;
  options.plot = Box2f(V2f(-3, -3), V2f(3, 3));
  const auto a = vegetation::sample_canopy(*nested.scene, vegetation::optics_of_geometries(*nested.scene), options),
             b = vegetation::sample_canopy(*flat.scene, vegetation::optics_of_geometries(*flat.scene), options);
  const auto area = [](const vegetation::CanopySurvey& survey, bool is_flat) {
    double sum = 0;
    for (const auto& kind : survey.kinds) sum += kind.flat == is_flat ? kind.area_m2 : 0;
    return sum;
  };
  for (const bool leaves : {false, true}) {
    EXPECT_GT(area(b, leaves), 1);
    EXPECT_NEAR(area(a, leaves), area(b, leaves), 1e-3 * area(b, leaves));
  }
}

// What stands in objects is seen by rays.
TEST_F(NestedPictures, OfImagesAreSeenByRays) {
  path::PathIntegrator::Settings rays = canopy_settings(*nested.scene);
  const impostor::ImageIntegrator images(
      *nested.scene, impostor::make_tree_images(*nested.scene, {.resolution = 32}, {}), {rays, 1, 16});
  EXPECT_EQ(images.view().by_rays, text.paths());
  EXPECT_EQ(images.view().by_images, 0u);
  const auto a = render_built(nested, render::StopRules{.pixel_samples = 16}, images),
             b = render_built(flat, 16, canopy_settings(*flat.scene));
  expect_near(a.mean(), b.mean(), 0.02f, "images");
}

}  // namespace
}  // namespace dapple
