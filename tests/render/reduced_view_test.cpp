// SPDX-License-Identifier: Apache-2.0
// Sketches: a view of fewer pixels, and paths for which nothing is prepared.
#include "dapple/render/reduced_view.h"

#include <gtest/gtest.h>

#include <atomic>

#include "dapple/integrate/camera_batch.h"
#include "dapple/render/picture.h"
#include "dapple/scenefile/scene_description.h"

namespace dapple::render {
namespace {

const char* const room = R"(
LookAt 0 1 -5  0 1 0  0 1 0
Camera "perspective" "float fov" 45
Film "rgb" "integer xresolution" 67 "integer yresolution" 50 "float cropwindow" [.25 1 0 .5]
Sampler "zsobol" "integer pixelsamples" 16
Integrator "distribution" "integer bounces" 2
WorldBegin
LightSource "point" "rgb I" [20 20 20] "point3 from" [1 2.5 -2]
LightSource "point" "rgb I" [9 2 2] "point3 from" [-1 2.5 -2]
LightSource "infinite" "rgb L" [.2 .2 .3]
Shape "trianglemesh" "point3 P" [-4 0 -4  4 0 -4  4 0 4  -4 0 4] "integer indices" [0 2 1 0 3 2]
Translate -1 .6 0
Shape "sphere" "float radius" .6
)";

build::BuiltScene built() {
  Diagnostics diagnostics;
  return build::build_scene(scenefile::parse_pbrt(room, "room", "", diagnostics), {}, diagnostics);
}

TEST(ReducedView, HasFewerPixelsOfTheSameView) {
  build::BuiltScene scene = built();
  const V2i before = scene.scene->camera.settings().resolution;
  const scene::CameraRay ray = scene.scene->camera.generate(V2f(33.5f, 25), V2f(.5f, .5f), 0);
  {
    ReducedView view(*scene.scene, 8, 0);
    EXPECT_EQ(view.film().settings().resolution, V2i(9, 7));
    EXPECT_EQ(scene.scene->camera.settings().resolution, V2i(9, 7));
    EXPECT_EQ(view.film().width(), 9 - 17 / 8);
    EXPECT_EQ(view.film().height(), 4);
    // The middle is the middle.
    const scene::CameraRay reduced = scene.scene->camera.generate(V2f(4.5f, 3.5f), V2f(.5f, .5f), 0);
    EXPECT_NEAR(dot(reduced.ray.d, ray.ray.d), 1, 1e-4f);
  }
  EXPECT_EQ(scene.scene->camera.settings().resolution, before);
}

// Bit for bit the rays of these pixels of the whole.
TEST(ReducedView, MayHaveSomePixelsOfTheWhole) {
  build::BuiltScene scene = built();
  const PixelSets sets(16, 1);
  const V2i seen(20, 44), last(66, 49);
  integrate::CameraBatch whole, edge, sparse, wide;
  whole.generate(*scene.scene, Box2i(seen, seen + V2i(1, 1)), 3, sets);
  edge.generate(*scene.scene, Box2i(last, last + V2i(1, 1)), 3, sets);
  {
    ReducedView view(*scene.scene, 8, 0, ReducedView::Pixels::sparse);
    EXPECT_EQ(view.film().settings().resolution, V2i(9, 7));
    sparse.generate(*scene.scene, Box2i(V2i(2, 5), V2i(3, 6)), 3, sets);
    EXPECT_EQ(sparse.pixel[0], V2i(2, 5));
    EXPECT_EQ(sparse.seed[0], whole.seed[0]);
    EXPECT_EQ(sparse.ray[0].ray.d, whole.ray[0].ray.d);
    EXPECT_EQ(sparse.ray[0].cone_spread, whole.ray[0].cone_spread);
    sparse.generate(*scene.scene, Box2i(V2i(8, 6), V2i(9, 7)), 3, sets);
    EXPECT_EQ(sparse.ray[0].ray.d, edge.ray[0].ray.d);
  }
  ReducedView view(*scene.scene, 8, 0);
  wide.generate(*scene.scene, Box2i(V2i(2, 5), V2i(3, 6)), 3, sets);
  EXPECT_NE(wide.ray[0].ray.d, whole.ray[0].ray.d);
  EXPECT_GT(wide.ray[0].cone_spread, 7 * whole.ray[0].cone_spread);
}

// A sketch is unbiased: against path tracing of the same bounces. Over 1350 pixels of 36 samples, whose standard
// deviation is about their mean, the mean has a standard error of 0.5 %; the bound is six of them.
TEST(Sketches, AreRight) {
  build::BuiltScene scene = built();
  build::IntegratorRequest request;
  request.type = "distribution";
  request.bounces = 2;
  const auto mean = [&](const build::IntegratorRequest& r, uint32_t samples) {
    const auto integrator = build::make_integrator(*scene.scene, r, int(samples), 1);
    scene::Film film(scene.scene->film);
    StopRules rules;
    rules.pixel_samples = samples;
    const std::atomic<bool> never{false};
    RenderSession(*integrator, film, rules).run(never);
    double sum = 0;
    for (int y = film.settings().crop.min.y; y < film.settings().crop.max.y; ++y)
      for (int x = film.settings().crop.min.x; x < film.settings().crop.max.x; ++x)
        sum += double(film.pixel(x, y).luminance());
    return sum / (double(film.width()) * film.height());
  };
  const build::IntegratorRequest sketch = build::sketch_request(request);
  EXPECT_EQ(sketch.type, "path");
  build::IntegratorRequest paths;
  paths.type = "path";
  paths.bounces = 2;
  const double expected = mean(paths, 256);
  EXPECT_GT(expected, 0.1);
  EXPECT_NEAR(mean(sketch, 36) / expected, 1, 0.03);
}

// What is found out before rendering ends when it is told to.
TEST(Sketches, PreparationsStop) {
  build::BuiltScene scene = built();
  const std::atomic<bool> stop{true}, never{false};
  for (const char* type : {"path", "distribution"}) {
    build::IntegratorRequest request;
    request.type = type;
    request.bounces = 2;
    EXPECT_THROW(build::make_integrator(scene, request, 16, 0, StopToken(stop)), Stopped) << type;
    EXPECT_NO_THROW(build::make_integrator(scene, request, 16, 0, StopToken(never))) << type;
  }
  // With nothing to learn there are still readers to count.
  build::IntegratorRequest request;
  request.type = "distribution";
  request.light_learning = false;
  EXPECT_THROW(build::make_integrator(scene, request, 16, 0, StopToken(stop)), Stopped);
  PictureRequest picture;
  picture.integrator = request;
  EXPECT_THROW(Picture(scene, picture, StopToken(stop)), Stopped);
}

}  // namespace
}  // namespace dapple::render
