// SPDX-License-Identifier: Apache-2.0
// Frames of a plane that faces the camera, and of things before it, as a pinhole of closed form shows them.
#include "dapple/denoise/temporal_blend.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "dapple/base/error.h"
#include "dapple/base/hash.h"

namespace dapple::denoise {
namespace {

constexpr int width = 64, height = 48;
constexpr double focal = 40;  // pixels

/// Row vectors: at x = `eye`, looking along +z, y down on the screen.
M44f matrix_at(double eye) {
  const double fx = focal / width, fy = focal / height;
  M44d m(fx, 0, 0, 0, 0, fy, 0, 0, .5, .5, 1, 1, 0, 0, -.01, 0);
  M44d shift;
  shift.setTranslation(V3d(-eye, 0, 0));
  return M44f(shift * m);
}

struct Surface {
  double depth = 4;
  RGB albedo{.5f}, light{1};
  V3d motion{0, 0, 0};  // AOV's
};
/// What is seen at a place of the world's plane z = 1, of the ray through a pixel's middle.
using World = std::function<Surface(double x, double y)>;

float noise(int x, int y, int frame) {
  return to_unit_float(hash(uint64_t(x), uint64_t(y), uint64_t(frame))) - .5f;
}

SequenceFrame frame(double eye, const World& world, float amplitude, int seed, bool motion = false) {
  SequenceFrame f;
  f.camera = FrameCamera::make(matrix_at(eye), {width, height, 0, 0});
  f.noisy = f.albedo = f.normal = image::Image(width, height, 3);
  f.depth = image::Image(width, height, 1);
  if (motion) f.motion = image::Image(width, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const Surface s = world((x + .5 - width / 2.) / focal, (y + .5 - height / 2.) / focal);
      for (int c = 0; c < 3; ++c) {
        f.albedo.pixel(x, y)[c] = s.albedo[c];
        f.noisy.pixel(x, y)[c] = s.albedo[c] * s.light[c] * (1 + amplitude * noise(x, y, seed));
        f.normal.pixel(x, y)[c] = c == 2 ? -1 : 0;
        if (motion) f.motion.pixel(x, y)[c] = float(s.motion[c]);
      }
      f.depth.pixel(x, y)[0] = float(s.depth);
    }
  return f;
}

image::Image blended(const SequenceFrame& at, const SequenceFrame& other, double frames, double* share = nullptr) {
  const TemporalBlend::Neighbour n{&other, frames, 1};
  const TemporalBlend blend(at, std::span(&n, 1));
  if (share) *share = blend.share();
  const image::Image* images[] = {&other.noisy};
  return blend(at.noisy, images);
}

double rms(const image::Image& a, const image::Image& b, int x0 = 0, int x1 = width) {
  double sum = 0;
  for (int y = 0; y < height; ++y)
    for (int x = x0; x < x1; ++x) sum += std::pow(double(a.pixel(x, y)[1]) - double(b.pixel(x, y)[1]), 2);
  return std::sqrt(sum / height / (x1 - x0));
}

// Of a plane at depth 4, seen from `eye`: its place is what the ray meets there.
World plane(double eye) {
  return [eye](double x, double y) {
    const double X = 4 * x + eye, Y = 4 * y;
    Surface s;
    s.albedo = RGB(float(.5 + .06 * std::sin(9 * X) * std::cos(7 * Y)));
    s.light = RGB(float(1 + .2 * X));
    return s;
  };
}

TEST(FrameCamera, GoesToTheWorldAndBack) {
  const M44d perspective(.7, .1, .2, .3, -.2, .9, .1, .4, .5, .3, .8, .86, 1, 2, 3, 2.5);
  const M44d orthographic(.3, .1, .2, 0, -.1, .4, .1, 0, .2, .1, .9, 0, .5, .6, 7, 1);
  for (const M44d& m : {perspective, orthographic}) {
    const auto camera = FrameCamera::make(M44f(m), {640, 480, 100, 50});
    ASSERT_TRUE(camera);
    for (const double depth : {.5, 20.0}) {
      const V3d back = camera->place_of(camera->seen_at(37.5, 12.25, depth));
      EXPECT_NEAR(back.x, 37.5, 1e-6);
      EXPECT_NEAR(back.y, 12.25, 1e-6);
      EXPECT_NEAR(back.z, depth, 1e-9);
    }
  }
  const auto camera = FrameCamera::make(M44f(perspective), {640, 480, 0, 0});
  const V3d sky = camera->place_of(camera->seen_at(3, 4, 0));
  EXPECT_NEAR(sky.x, 3, 1e-6);
  EXPECT_EQ(sky.z, 0);
}

TEST(FrameCamera, RefusesMatricesWithoutAnInverse) {
  const FrameCamera::Window window{4, 4, 0, 0};
  EXPECT_FALSE(FrameCamera::make(M44f(0.f), window));
  M44f odd = matrix_at(0);
  odd[1][1] = std::nanf("");
  EXPECT_FALSE(FrameCamera::make(odd, window));
  EXPECT_FALSE(FrameCamera::make(matrix_at(0), {0, 4, 0, 0}));
}

// A frame and a neighbour of the same weight, of independent noise: bilinear look-ups at a half pixel take the mean of
// two, so that the variance of the mean is (1 + 1/2) / 4 of one frame's.
TEST(TemporalBlend, LeavesLessNoiseAndAllTexture) {
  const double eye = 4 / focal * 3.5;
  const SequenceFrame clean = frame(0, plane(0), 0, 0);
  const SequenceFrame at = frame(0, plane(0), .3f, 1), other = frame(eye, plane(eye), .3f, 2);
  double share = 0;
  const image::Image out = blended(at, other, 1, &share);
  EXPECT_GT(share, .85);  // 60.5 of 64 columns are seen
  const double ratio = rms(out, clean.noisy, 8) / rms(at.noisy, clean.noisy, 8);
  EXPECT_NEAR(ratio, std::sqrt(.375), .06);
  // Without noise it is the frame itself, but for what is linear between pixels.
  EXPECT_LT(rms(blended(clean, frame(eye, plane(eye), 0, 0), 1), clean.noisy), 2e-3);
}

TEST(TemporalBlend, TakesNothingOfWhatIsHidden) {
  // A bar at depth 2 covers the columns from -.2 to .2 of the world; the second frame is from 1 to the right.
  const auto world = [](double eye) {
    return [eye](double x, double y) {
      if (std::abs(2 * x + eye) < .2) {
        Surface bar;
        bar.depth = 2, bar.albedo = RGB(.5f), bar.light = RGB(5);
        return bar;
      }
      return plane(eye)(x, y);
    };
  };
  const SequenceFrame at = frame(0, world(0), 0, 0), other = frame(1, world(1), 0, 0);
  const image::Image out = blended(at, other, 1);
  // Nothing of the bar's light falls on the plane, nor the other way round.
  EXPECT_LT(rms(out, at.noisy), 3e-3);
}

TEST(TemporalBlend, TakesNothingBeyondTheEdge) {
  double share = 1;
  const SequenceFrame at = frame(0, plane(0), .3f, 1), other = frame(9, plane(9), .3f, 2);
  const image::Image out = blended(at, other, 1, &share);
  EXPECT_EQ(share, 0);
  EXPECT_EQ(rms(out, at.noisy), 0);
}

// A shadow that falls to a third of the frame between two frames, under noise that is as large.
TEST(TemporalBlend, TakesNothingInAnotherLight) {
  const World lit = plane(0);
  const World shaded = [&](double x, double y) {
    Surface s = lit(x, y);
    if (x > .3) s.light *= .4f;
    return s;
  };
  const SequenceFrame at = frame(0, lit, .5f, 1), other = frame(0, shaded, .5f, 2);
  const image::Image out = blended(at, other, 1);
  const int edge = int(width / 2 + .3 * focal);
  EXPECT_LT(rms(out, at.noisy, edge + 1), 1e-6);
  // Away from the shadow all counts.
  const SequenceFrame clean = frame(0, lit, 0, 0);
  EXPECT_LT(rms(out, clean.noisy, 0, edge - 10), .8 * rms(at.noisy, clean.noisy, 0, edge - 10));
}

// A whole frame that grows brighter by a seventh, as by a dimmer, is found by its larger squares.
TEST(TemporalBlend, FindsFaintChangesOfWideLight) {
  const World lit = plane(0);
  const World brighter = [&](double x, double y) {
    Surface s = lit(x, y);
    s.light *= 1.15f;
    return s;
  };
  double share = 1;
  blended(frame(0, lit, .4f, 1), frame(0, brighter, .4f, 2), 1, &share);
  EXPECT_LT(share, .05);
}

// A textured plane that moves by itself, 3 pixels a frame to the right.
TEST(TemporalBlend, FollowsMotion) {
  const auto moved = [](double by) {
    return [by](double x, double y) {
      Surface s = plane(0)(x - by, y);
      s.albedo = RGB(float(.5 + .3 * std::sin(60 * (x - by))));
      s.motion = V3d(3, 0, 0);
      return s;
    };
  };
  const SequenceFrame at = frame(0, moved(0), 0, 0, true), next = frame(0, moved(3 / focal), 0, 0, true),
                      before = frame(0, moved(-6 / focal), 0, 0, true);
  double share = 0;
  EXPECT_LT(rms(blended(at, next, 1, &share), at.noisy), 1e-5);
  EXPECT_GT(share, .9);
  EXPECT_LT(rms(blended(at, before, -2, &share), at.noisy), 1e-5);
  EXPECT_GT(share, .85);
  SequenceFrame still = at;
  still.motion = image::Image();
  blended(still, next, 1, &share);
  EXPECT_LT(share, .6);  // most of the texture is elsewhere
}

// A plane that is slower before this frame than after it, while the camera moves too.
TEST(TemporalBlend, FollowsMotionToThePreviousFrame) {
  const double eye = 4 / focal * 2;  // 2 pixels at depth 4
  const auto at_place = [](double by, double camera) {
    return [by, camera](double x, double y) {
      Surface s = plane(camera)(x - by, y);
      s.albedo = RGB(float(.5 + .3 * std::sin(60 * (x - by + camera / 4))));
      s.motion = V3d(3, 0, 0);
      return s;
    };
  };
  SequenceFrame at = frame(0, at_place(0, 0), 0, 0, true);
  const SequenceFrame before = frame(eye, at_place(-1 / focal, eye), 0, 0, true);
  double share = 0;
  blended(at, before, -1, &share);
  EXPECT_LT(share, .6);
  at.motion_back = image::Image(width, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) at.motion_back.pixel(x, y)[0] = -3;  // 1 by itself, 2 by the camera
  at.camera_of_previous = FrameCamera::make(matrix_at(eye), {width, height, 0, 0});
  EXPECT_LT(rms(blended(at, before, -1, &share), at.noisy), 1e-4);
  EXPECT_GT(share, .9);
}

// The camera goes to the right while the shutter is open: the motion of still things is its own, by the matrices.
TEST(TemporalBlend, TakesTheCamerasMotionOff) {
  const double eye = 4 / focal * 3;  // 3 pixels at depth 4
  const auto still = [](double e) {
    return [e](double x, double y) {
      Surface s = plane(e)(x, y);
      s.motion = V3d(-3, 0, 0);
      return s;
    };
  };
  SequenceFrame at = frame(0, still(0), 0, 0, true);
  const SequenceFrame next = frame(eye, still(eye), 0, 0, true);
  at.camera_at_close = FrameCamera::make(matrix_at(eye / 2), {width, height, 0, 0});
  at.shutters_a_frame = 2;
  double share = 0;
  EXPECT_LT(rms(blended(at, next, 1, &share), at.noisy), 1e-4);
  EXPECT_GT(share, .9);
}

TEST(TemporalBlend, StaysFiniteOnOddNumbers) {
  SequenceFrame at = frame(0, plane(0), .3f, 1), other = frame(.1, plane(.1), .3f, 2);
  for (image::Image* i : {&at.noisy, &other.noisy, &other.albedo, &at.normal, &other.depth, &at.depth}) {
    i->pixel(30, 20)[0] = std::nanf("");
    i->pixel(20, 20)[0] = infinity;
    i->pixel(25, 22)[0] = -1e30f;
  }
  const image::Image out = blended(at, other, 1);
  for (size_t i = 0; i < out.pixels().size(); ++i) EXPECT_TRUE(std::isfinite(out.pixels()[i])) << i;
}

TEST(TemporalBlend, RefusesOtherSizes) {
  const SequenceFrame at = frame(0, plane(0), 0, 0);
  SequenceFrame other = at;
  other.noisy = image::Image(8, 8, 3);
  EXPECT_THROW(blended(at, other, 1), UsageError);
}

}  // namespace
}  // namespace dapple::denoise
