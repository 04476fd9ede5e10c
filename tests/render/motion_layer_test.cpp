// SPDX-License-Identifier: Apache-2.0
// AOV motion against closed forms: a pinhole's f x / z, before and after.
#include <gtest/gtest.h>

#include "dapple/base/parallel.h"
#include "dapple/render/frame_denoiser.h"
#include "tests/support/render_text.h"

namespace dapple {
namespace {

// 20 x 20 pixels, 90 degrees: focal length 10 pixels. From z = 5 downwards; +x of the world is to the left, +y up.
std::string head(const std::string& camera, const std::string& place = "LookAt 0 0 5  0 0 0  0 1 0") {
  return place + "\nCamera \"perspective\" \"float fov\" 90 " + camera +
         "\nFilm \"rgb\" \"integer xresolution\" 20 \"integer yresolution\" 20\nPixelFilter \"box\"\nWorldBegin\n";
}
std::string moving(const std::string& end, const std::string& what) {
  return "AttributeBegin\nActiveTransform EndTime\n" + end + "\nActiveTransform All\n" + what + "AttributeEnd\n";
}
const std::string floor_ = "Shape \"bilinearmesh\" \"point3 P\" [ -9 -9 0  9 -9 0  -9 9 0  9 9 0 ]\n";
const std::string still_camera = "\"float shutteropen\" 0 \"float shutterclose\" 1 ";

image::Image motion_of(const std::string& text, int samples = 4) {
  const build::BuiltScene built = test::build_text(text);
  return render::trace_motion(*built.scene, built.scene->film.crop, {samples, 0, 4});
}

void expect_everywhere(const image::Image& motion, const V3f& expected, float tolerance) {
  for (int y = 0; y < motion.height(); ++y)
    for (int x = 0; x < motion.width(); ++x)
      for (int c = 0; c < 3; ++c)
        ASSERT_NEAR(motion.pixel(x, y)[c], expected[c], tolerance) << x << ", " << y << ", channel " << c;
}

TEST(MotionLayer, IsZeroWhereNothingMoves) {
  expect_everywhere(motion_of(head("") + floor_), V3f(0, 0, 0), 0);
  expect_everywhere(motion_of(head("")), V3f(0, 0, 0), 0);
}

// Along the screen: 10 pixels / 5 m.
TEST(MotionLayer, IsThatOfMovingSurfaces) {
  const std::string floor = moving("Translate .5 .25 0", floor_);
  expect_everywhere(motion_of(head(still_camera) + floor), V3f(-1, -.5f, 0), 1e-4f);
  // The next frame is twice as far as the shutter is open; half of it, for which the shutter is open, is half the way.
  expect_everywhere(motion_of(head(still_camera + "\"float frameinterval\" 2") + floor), V3f(-2, -1, 0), 1e-4f);
  expect_everywhere(motion_of(head("\"float shutterclose\" .5") + floor), V3f(-.5f, -.25f, 0), 1e-4f);
  expect_everywhere(motion_of(head("\"float shutterclose\" .5 \"float frameinterval\" 1") + floor), V3f(-1, -.5f, 0),
                    1e-4f);
}

// Towards the camera by 1 of 5 m: places grow from the middle by 5 / 4, and depth falls.
TEST(MotionLayer, GrowsTowardsTheCamera) {
  const image::Image motion = motion_of(
      head("\"float shutterclose\" 1e-3 \"float frameinterval\" 1e-3") + moving("Translate 0 0 1", floor_), 16);
  // So short a shutter is open at the start: to first order x / z for each m.
  for (const int x : {0, 5, 19}) {
    EXPECT_NEAR(motion.pixel(x, 3)[0], (float(x) + .5f - 10) / 5 * 1e-3f, .02e-3f) << x;
    EXPECT_NEAR(motion.pixel(x, 3)[2], -1e-3f, 1e-6f);
  }
}

TEST(MotionLayer, IsThatOfDeformingMeshes) {
  // By 1 m along x in all its places.
  const std::string mesh =
      "Shape \"trianglemesh\" \"point3 P\" [ -90 -90 0  90 -90 0  0 190 0 ] \"point3 P1\" [ -89 -90 0  91 -90 0  1 190 "
      "0 ] "
      "\"integer indices\" [ 0 1 2 ]\n";
  expect_everywhere(motion_of(head(still_camera) + mesh), V3f(-2, 0, 0), 1e-4f);
}

// The camera goes up by 1 m: all at depth 5 goes down by 2 pixels, what is endlessly far stays.
TEST(MotionLayer, IsThatOfTheCamera) {
  const std::string camera =
      "ActiveTransform StartTime LookAt 0 0 5  0 0 0  0 1 0\nActiveTransform EndTime LookAt 0 1 5  0 1 0  0 1 0\n"
      "ActiveTransform All";
  expect_everywhere(motion_of(head(still_camera, camera) + floor_), V3f(0, 2, 0), 1e-4f);
  expect_everywhere(motion_of(head(still_camera, camera)), V3f(0, 0, 0), 1e-5f);
}

// Turned by an angle, the middle of the sky goes f tan(angle) sideways.
TEST(MotionLayer, SkiesTurn) {
  const std::string camera =
      "ActiveTransform StartTime LookAt 0 0 5  0 0 0  0 1 0\nActiveTransform EndTime LookAt 0 0 5  .5 0 0  0 1 0\n"
      "ActiveTransform All";
  const image::Image motion = motion_of(head(still_camera, camera), 16);
  float middle = 0;
  for (const int x : {9, 10}) middle += .5f * motion.pixel(x, 10)[0];
  EXPECT_NEAR(middle, 10 * .1f, .02f);
}

TEST(MotionLayer, IsTheSameForAnyThreads) {
  const std::string text = head(still_camera) + moving("Rotate 20 0 0 1", floor_);
  set_thread_count(1);
  const image::Image one = motion_of(text);
  set_thread_count(4);
  const image::Image four = motion_of(text);
  set_thread_count(0);
  EXPECT_TRUE(std::ranges::equal(one.pixels(), four.pixels()));
}

TEST(MotionLayer, SphericalCamerasHaveNone) {
  expect_everywhere(motion_of("Camera \"spherical\"\nFilm \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 4\n"
                              "WorldBegin\n" +
                              moving("Translate 1 0 0", floor_)),
                    V3f(0, 0, 0), 0);
}

TEST(MotionLayer, RefusesIntervalsBeyondBounds) {
  EXPECT_THROW(motion_of(head("\"float shutterclose\" 1e-20 \"float frameinterval\" 1e30") + floor_), InputError);
  EXPECT_THROW(motion_of(head("\"float frameinterval\" -1") + floor_), InputError);
  EXPECT_THROW(motion_of(head("\"float frameinterval\" 0") + floor_), InputError);
}

}  // namespace
}  // namespace dapple
