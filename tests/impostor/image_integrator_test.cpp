// SPDX-License-Identifier: Apache-2.0
// Pictures of trees as images.
#include "dapple/impostor/image_integrator.h"

#include <gtest/gtest.h>

#include "dapple/base/parallel.h"
#include "dapple/depthimage/image_file.h"
#include "dapple/light/shaft_builder.h"
#include "tests/support/render_text.h"
#include "tests/support/test_trees.h"

namespace dapple {
namespace {

using test::build_text;
using test::bush;
using test::bush_field;
using test::canopy_settings;
using test::render_built;
using test::RenderedText;

impostor::ImageIntegrator images_of(const scene::Scene& scene, int resolution, float texel_pixels = 1,
                                    int pixel_points = 16, bool gather = false) {
  path::PathIntegrator::Settings rays = canopy_settings(scene);
  rays.canopy_gather = gather;
  return {scene, impostor::make_tree_images(scene, {.resolution = resolution}, {}), {rays, texel_pixels, pixel_points}};
}

void expect_alike(const RGB& value, const RGB& reference, float relative, const std::string& what) {
  test::expect_near(value, reference, relative, what);
}

// Rationale: images and rays show the same things, under the same light. Expectation: the picture's mean is that of the
// canopy's integrator without images, to 2 %, whether all bushes are images, some, or none.
TEST(ImageIntegrator, ShowsWhatTheCanopyIntegratorShows) {
  const build::BuiltScene built = build_text(bush_field());
  const RGB reference = render_built(built, 64, canopy_settings(*built.scene)).mean();
  for (const int resolution : {64, 16, 8}) {
    const auto integrator = images_of(*built.scene, resolution);
    const auto& view = integrator.view();
    EXPECT_TRUE(resolution != 64 || view.by_images == 25u);
    EXPECT_TRUE(resolution != 8 || view.by_rays == 25u);
    expect_alike(render_built(built, 16, integrator).mean(), reference, 0.02f, std::to_string(resolution));
  }
  // By path tracing what rays see.
  expect_alike(render_built(built, 64, images_of(*built.scene, 64, 1, 16, true)).mean(), reference, 0.05f, "gathered");
}

// Rationale: haze before images is what it is before rays. Expectation: a field in air that thins out with height, sun
// and sky scattered once by scan planes: the mean to 3 %, and it is not that of clear air.
TEST(ImageIntegrator, HazeByScanPlanes) {
  const std::string air =
      "MakeNamedMedium \"air\" \"string type\" \"exponential\" \"rgb sigma_s\" [ .02 .02 .02 ] \"rgb sigma_a\" [ "
      ".001 .001 .001 ] \"float scaleheight\" 20\nMediumInterface \"\" \"air\"\n"
      "LookAt 0 -30 8  0 0 0.5  0 0 1 Camera \"perspective\" \"float fov\" 20\n";
  std::string text = bush_field(air);
  text.insert(text.find("WorldBegin") + 10, "\nMediumInterface \"\" \"\"");  // of the camera alone
  const build::BuiltScene built = build_text(text);
  path::PathIntegrator::Settings rays = canopy_settings(*built.scene);
  std::string why;
  std::vector<std::string> left;
  light::ShaftSettings single;
  single.single = true;
  rays.shafts = light::make_shaft_light(*built.scene, single, &why, &left);
  ASSERT_TRUE(rays.shafts) << why;
  const RGB reference = render_built(built, 64, rays).mean();
  const impostor::ImageIntegrator images(*built.scene, impostor::make_tree_images(*built.scene, {.resolution = 64}, {}),
                                         {rays, 1, 16});
  EXPECT_EQ(images.view().by_images, 25u);
  expect_alike(render_built(built, 16, images).mean(), reference, 0.03f, "haze");
  const RGB clear = render_built(build_text(bush_field()), 16, canopy_settings(*built.scene)).mean();
  EXPECT_GT(std::abs(clear.b - reference.b), 0.05f * clear.b);
  EXPECT_THROW(images_of(*built.scene, 8), std::invalid_argument) << "without scan planes";
  const build::BuiltScene bounded = build_text(bush_field(air));
  EXPECT_THROW(impostor::ImageIntegrator(
                   *bounded.scene, impostor::make_tree_images(*bounded.scene, {.resolution = 8}, {}), {rays, 1, 1}),
               std::invalid_argument)
      << "surfaces between media";
}

// Fewer points a pixel are drawn at random, and change no mean.
TEST(ImageIntegrator, FewerPointsHaveTheSameMean) {
  const build::BuiltScene built = build_text(bush_field());
  const RGB all = render_built(built, 16, images_of(*built.scene, 64)).mean();
  expect_alike(render_built(built, 16, images_of(*built.scene, 64, 1, 1)).mean(), all, 0.005f, "one point");
}

TEST(ImageIntegrator, SamePictureForAnyNumberOfThreads) {
  const build::BuiltScene built = build_text(bush_field());
  const int before = thread_count();
  std::optional<RenderedText> first;
  for (const int threads : {1, 2, 4}) {
    set_thread_count(threads);
    RenderedText r = render_built(built, 3, images_of(*built.scene, 32, 1, 2));
    EXPECT_TRUE(!first || test::same_bits(first->film, r.film)) << threads;
    if (!first) first.emplace(std::move(r));
  }
  set_thread_count(before);
}

// Rationale: nothing may pop as the camera comes nearer, over all switches of levels and to rays; the field of view
// follows, so that the bush keeps its place in the picture. Expectation: steps of the picture's mean of at most .005 of
// the sky's light.
TEST(ImageIntegrator, NothingPopsInAZoom) {
  double before = 0, worst = 0;
  int by_rays = 0, by_images = 0;
  for (int frame = 0; frame < 100; ++frame) {
    const double distance = 60 * std::pow(0.1, frame / 99.0);
    const std::string camera = "LookAt 0 -" + std::to_string(distance) +
                               " 1.2  0 0 1.2  0 0 1 Camera \"perspective\" \"float fov\" " +
                               std::to_string(2 * std::atan(1.6 / distance) * 180 / 3.14159265358979) + "\n";
    std::string text = camera + R"(Film "rgb" "integer xresolution" )" + std::to_string(int(600 / distance) + 8) +
                       " \"integer yresolution\" " + std::to_string(int(600 / distance) + 8) +
                       R"( PixelFilter "box" WorldBegin LightSource "infinite" "rgb L" [ 1 1 1 ])" + bush() +
                       "ObjectInstance \"bush\"";
    const build::BuiltScene built = build_text(text);
    const auto integrator = images_of(*built.scene, 32);
    by_rays += integrator.view().by_rays > 0, by_images += integrator.view().by_images > 0;
    const RenderedText r = render_built(built, 16, integrator);
    double mean = 0;
    const int n = r.film.width();
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) mean += 1 - double(r.film.pixel(x, y).g);
    mean /= double(n) * n;
    if (frame > 0) worst = std::max(worst, std::abs(mean - before));
    before = mean;
  }
  std::printf("worst step of the mean: %.4f\n", worst);
  EXPECT_GT(by_rays, 5);
  EXPECT_GT(by_images, 50);
  EXPECT_LE(worst, 0.005);
}

TEST(ImageIntegrator, RefusesWhatItCannotShow) {
  const auto refuses = [](const std::string& text, const char* what) {
    const build::BuiltScene built = build_text(text);
    try {
      images_of(*built.scene, 8);
      ADD_FAILURE() << what;
    } catch (const std::invalid_argument& e) {
      EXPECT_NE(std::string(e.what()).find(what), std::string::npos) << e.what();
    }
  };
  refuses(bush_field("Camera \"spherical\"\n"), "all around");
  refuses(bush_field("Camera \"perspective\" \"float lensradius\" .1\n"), "depth of field");
  refuses(bush_field("ActiveTransform StartTime Translate 0 0 1 ActiveTransform All Camera \"perspective\"\n"),
          "moves");
}

TEST(ObjectBaker, RefusesWhatImagesDoNotHold) {
  const auto refusal = [](const std::string& things) {
    const build::BuiltScene built =
        build_text("Camera \"perspective\" WorldBegin ObjectBegin \"a\" " + things + " ObjectEnd ObjectInstance \"a\"");
    return impostor::ObjectBaker(*built.scene, {}).refusal(0);
  };
  EXPECT_EQ(refusal("Material \"diffuse\" Shape \"sphere\""), "");
  EXPECT_EQ(refusal("Material \"dielectric\" Shape \"sphere\""), "materials that are not diffuse");
  EXPECT_EQ(refusal("Shape \"curve\" \"point3 P\" [ 0 0 0 1 0 0 2 0 0 3 0 0 ]"), "curves");
  EXPECT_EQ(refusal(""), "nothing");
  const build::BuiltScene built = build_text("Camera \"perspective\" WorldBegin");
  EXPECT_THROW(impostor::ObjectBaker(*built.scene, {.resolution = 100}), std::invalid_argument);
  EXPECT_THROW(impostor::ObjectBaker(*built.scene, {.views = 5}), std::invalid_argument);
  EXPECT_THROW(impostor::ObjectBaker(*built.scene, {.layers = -1}), std::invalid_argument);
}

// A key tells whether images are still those of the object.
TEST(ObjectBaker, ImagesFromFilesAreTheSameWhileTheKeyIs) {
  const build::BuiltScene built = build_text(bush_field());
  const impostor::ObjectBaker baker(*built.scene, {.resolution = 16});
  const auto baked = depthimage::decode_images(depthimage::encode_images({baker.bake(0, "bush")}), "test");
  const auto again = impostor::make_tree_images(*built.scene, {.resolution = 16}, baked);
  EXPECT_EQ(again.from_file, 1u);
  EXPECT_EQ(again.baked, 0u);
  std::string other = bush_field();
  other.replace(other.find("[ .1 .3 .1 ]"), 12, "[ .1 .4 .1 ]");
  const build::BuiltScene changed = build_text(other);
  EXPECT_EQ(impostor::make_tree_images(*changed.scene, {.resolution = 16}, baked).from_file, 0u);
}

// Of cut-outs as much is there as their opacity says: a plate of alpha .3, seen squarely.
TEST(ObjectBaker, CutOutsCoverByTheirOpacity) {
  const build::BuiltScene built = build_text(
      "Camera \"perspective\" WorldBegin ObjectBegin \"a\" Material \"diffuse\" Shape \"bilinearmesh\" \"point3 P\" [ "
      "-1 -1 0 "
      "1 -1 0 -1 1 0 1 1 0 ] \"float alpha\" .3 ObjectEnd ObjectInstance \"a\"");
  const auto images = impostor::ObjectBaker(*built.scene, {.resolution = 64}).bake(0, "a");
  double samples = 0;
  for (const auto& view : images.levels[0].views)
    for (const auto& f : view.fragments) samples += std::popcount(unsigned(f.mask));
  // Four standard errors of 65536 draws.
  EXPECT_NEAR(samples / (256 * 256), 0.3, 4 * std::sqrt(0.3 * 0.7) / 256);
}

}  // namespace
}  // namespace dapple
