// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/scene_origin.h"

#include <gtest/gtest.h>

#include "dapple/build/scene_builder.h"
#include "dapple/scenefile/far_points.h"

namespace dapple::build {
namespace {

using Imath::Box3d;

struct Built {
  BuiltScene scene;
  std::vector<std::string> messages;
};

Built built(const std::string& world, const std::string& head = "") {
  Diagnostics diagnostics(false);
  const std::string camera =
      head + "\nCamera \"perspective\" Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8\n";
  const auto description =
      scenefile::parse_pbrt(camera + "WorldBegin\nLightSource \"infinite\"\n" + world, "test.pbrt", ".", diagnostics);
  Built b{build_scene(description, {}, diagnostics), {}};
  b.messages = diagnostics.messages();
  return b;
}

/// Bounds in the coordinates of the file.
Box3d bounds_of(const BuiltScene& scene) {
  const Box3f box = scene.scene->traced.bounds();
  return {V3d(box.min) + scene.origin, V3d(box.max) + scene.origin};
}

// A triangle with corners that floats hold only near the origin: at 5.4e6 their steps are .5.
void expect_triangle_at(const BuiltScene& scene, const V3d& at) {
  const Box3d box = bounds_of(scene);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(box.min[k] - at[k], 0.125, 1e-5) << k;
    EXPECT_NEAR(box.max[k] - at[k], 1.375, 1e-5) << k;
  }
}

TEST(SceneOrigin, IsZeroNearAndOnAGridFar) {
  EXPECT_EQ(origin_of(Box3d(V3d(-5), V3d(100))), V3d(0));
  EXPECT_EQ(origin_of(Box3d(V3d(100), V3d(110))), V3d(0));    // 100 is not far
  EXPECT_EQ(origin_of(Box3d(V3d(1000), V3d(1100))), V3d(0));  // 10 extents
  EXPECT_EQ(origin_of(Box3d(V3d(10), V3d(10.01))), V3d(0));   // 1000 extents
  EXPECT_EQ(origin_of(Box3d(V3d(0), V3d(0))), V3d(0));
  EXPECT_EQ(origin_of(Box3d(V3d(1, 2, 3), V3d(1, 2, 3))), V3d(1, 2, 3));
  const V3d room(50.0022, 20.0011, 1.0015), its = origin_of(Box3d(room, room + V3d(.0044)));
  EXPECT_LT((its - room).length(), 8 * .0044 * std::sqrt(3.0));
  const V3d far = origin_of(Box3d(V3d(5e5, 5.4e6, 300), V3d(5e5 + 10, 5.4e6 + 10, 302)));
  EXPECT_LT((far - V3d(5e5, 5.4e6, 300)).length(), 8 * 10.0 * std::sqrt(3.0));
  for (int k = 0; k < 3; ++k) EXPECT_EQ(std::fmod(far[k], 64), 0);  // the power of two from 4 extents on
  EXPECT_EQ(far, origin_of(Box3d(V3d(5e5, 5.4e6 - 3, 300), V3d(5e5 + 12, 5.4e6 + 10, 303))));
}

TEST(SceneOrigin, OfPointsAndTransformsGivesTheSceneOfTheOrigin) {
  const std::string own =
      R"(Shape "trianglemesh" "point3 P" [500000.125 5400000.125 300.125  500001.375 5400000.125 300.125  500000.125 5400001.375 301.375])";
  const std::string local = R"("point3 P" [.125 .125 .125  1.375 .125 .125  .125 1.375 1.375])";
  const V3d at(500000, 5400000, 300);
  expect_triangle_at(built(own).scene, at);
  expect_triangle_at(built("Translate 500000 5400000 300 Shape \"trianglemesh\" " + local).scene, at);
  expect_triangle_at(built("ObjectBegin \"o\" Shape \"trianglemesh\" " + local +
                           " ObjectEnd Translate 500000 5400000 300 ObjectInstance \"o\"")
                         .scene,
                     at);
  // The definition lies far out and its instance brings it back.
  const BuiltScene back =
      built("ObjectBegin \"o\" " + own + " ObjectEnd Translate -500000 -5400000 -300 ObjectInstance \"o\"").scene;
  EXPECT_EQ(back.origin, V3d(0));
  expect_triangle_at(back, V3d(0));
  const BuiltScene moving = built("ActiveTransform EndTime Translate 0 0 0.0000001 ActiveTransform All " + own).scene;
  expect_triangle_at(moving, at);
}

// At 5.4e6 floats are half a metre apart.
TEST(SceneOrigin, PlotsOfCanopiesAreReadAsDoubles) {
  const std::string leaf =
      R"(Shape "trianglemesh" "point3 P" [500000.125 5400000.125 300.125  500001.375 5400000.125 300.125  500000.125 5400001.375 301.375])";
  const BuiltScene far =
      built(leaf, "Integrator \"canopy\" \"float plot\" [ 500000.2 500001.3 5400000.2 5400001.3 ]").scene;
  ASSERT_TRUE(far.request.canopy_plot);
  EXPECT_EQ(far.request.canopy_plot->min, Imath::V2d(500000.2, 5400000.2));
  EXPECT_EQ(far.request.canopy_plot->max, Imath::V2d(500001.3, 5400001.3));
  const BuiltScene near = built("Shape \"sphere\"", "Integrator \"canopy\" \"float plot\" [ -1.5 1 -2 .1 ]").scene;
  EXPECT_EQ(near.request.canopy_plot->max, Imath::V2d(1, double(.1f)));
  EXPECT_THROW(
      built("Shape \"sphere\"", "Integrator \"canopy\" \"float plot\" [ 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 ]"),
      InputError);
}

TEST(SceneOrigin, CanBeGiven) {
  const Built b = built("Shape \"sphere\"", "Option \"point3 origin\" [ 100 0 -7 ]");
  EXPECT_EQ(b.scene.origin, V3d(100, 0, -7));
  EXPECT_EQ(b.scene.scene->traced.bounds().center(), V3f(-100, 0, 7));
  EXPECT_TRUE(b.messages.empty());
}

TEST(SceneOrigin, TooMuchExtentIsSaidOnce) {
  const Built b =
      built("Translate 1e7 0 0 Shape \"sphere\" Translate 2 0 0 Shape \"sphere\" Translate -2e7 0 0 Shape \"sphere\"");
  ASSERT_EQ(b.messages.size(), 1u);
  EXPECT_NE(b.messages[0].find("steps of single precision"), std::string::npos) << b.messages[0];
}

TEST(Geometry, Beyond1e10IsSaid) {
  const Built b = built("Shape \"sphere\" \"float radius\" 3e10");
  ASSERT_EQ(b.messages.size(), 1u);
  EXPECT_NE(b.messages[0].find("beyond 1e10"), std::string::npos) << b.messages[0];
}

TEST(FarPoints, FloatsKeepTheirValues) {
  std::vector<V3f> P = {{5400000.5f, 300.0625f, 1}, {5400011.f, 301.1f, -2}};
  const std::vector<V3f> before = P;
  const V3d base = scenefile::take_off_base(&P);
  EXPECT_EQ(base, V3d(5400000, 300, 0));
  for (size_t i = 0; i < P.size(); ++i) EXPECT_EQ(V3f(V3d(P[i]) + base), before[i]);
}

// Shutter half open: a definition's moving sphere is where the instance's transform takes it.
TEST(MovingShapes, InDefinitionsMove) {
  const Built b = built(
      "ObjectBegin \"o\" ActiveTransform EndTime Translate 4 0 0 ActiveTransform All Shape \"sphere\" ObjectEnd "
      "Translate 10 0 0 ObjectInstance \"o\"");
  EXPECT_TRUE(b.messages.empty()) << b.messages[0];
  const Box3f box = b.scene.scene->traced.bounds();
  EXPECT_NEAR(box.min.x, 9, 1e-4);
  EXPECT_NEAR(box.max.x, 15, 1e-4);
}

}  // namespace
}  // namespace dapple::build
