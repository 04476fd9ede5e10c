// SPDX-License-Identifier: Apache-2.0
#include "dapple/scene/lens_system.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "dapple/base/hash.h"

namespace dapple::scene {
namespace {

/// A symmetrical lens of focal length f (lensmaker), thin: of so high an index that its surfaces are nearly flat. Its
/// middle is as thick as its edge asks for.
std::vector<LensSystem::Surface> thin_lens(double f, double half_width, double stop) {
  constexpr double index = 5;
  const double R = 2 * f * (index - 1), thickness = 1.1 * half_width * half_width / R;
  std::vector<LensSystem::Surface> s{{R, thickness, index, half_width, 0}, {-R, 1e-4 + thickness, 1, half_width, 0}};
  if (stop > 0) s.push_back({0, 0, 1, stop, 0});
  return s;
}

/// Two thin lenses d apart.
std::vector<LensSystem::Surface> two_lenses(double f1, double f2, double d) {
  auto all = thin_lens(f1, 0.002, 0), second = thin_lens(f2, 0.002, 0);
  all.back().thickness = d;
  all.insert(all.end(), second.begin(), second.end());
  return all;
}

// Where rays from one point of the film cross the axis (or the height that its image has), near the axis.
V3f crossing(const LensSystem& lens, const V2f& film, float distance, const V2f& on_rear) {
  const V3f o(film.x, film.y, 0);
  V3f out, d;
  EXPECT_TRUE(lens.to_scene(o, normalize(V3f(on_rear.x, on_rear.y, float(lens.rear())) - o), &out, &d));
  return out + d * ((distance - out.z) / d.z);
}

TEST(LensSystem, OneThinLensFollowsItsEquation) {
  constexpr double f = 0.05;
  for (const double distance : {0.5, 2.0, 20.0}) {
    const LensSystem lens(thin_lens(f, 0.002, 0), {}, 0.035, distance);
    EXPECT_NEAR(lens.focal_length() / f, 1, 0.001);
    const double image = lens.image_distance(), object = distance - image;
    EXPECT_NEAR((1 / image + 1 / object) * f, 1, 0.001);
    // Rays from the film's middle meet on the axis there, from beside it at a height of the ratio of the distances.
    for (const float h : {0.0f, 0.001f}) {
      const V3f p = crossing(lens, V2f(h, 0), float(distance), V2f(0.0005f, 0)),
                q = crossing(lens, V2f(h, 0), float(distance), V2f(-0.0005f, 0.0003f));
      EXPECT_NEAR(p.x, q.x, 0.005 * 0.001 * object / image);
      EXPECT_NEAR(p.x, -double(h) * object / image, 0.005 * 0.001 * object / image);
    }
  }
}

// 1/f = 1/f1 + 1/f2 - d/(f1 f2), and the place where film points are sharp.
TEST(LensSystem, TwoLensesFollowGullstrand) {
  constexpr double f1 = 0.08, f2 = 0.12, d = 0.02, distance = 1.5;
  const LensSystem lens(two_lenses(f1, f2, d), {}, 0.035, distance);
  EXPECT_NEAR(lens.focal_length() * (1 / f1 + 1 / f2 - d / (f1 * f2)), 1, 0.001);
  const V3f p = crossing(lens, V2f(0, 0), float(distance), V2f(0.001f, 0)),
            q = crossing(lens, V2f(0, 0), float(distance), V2f(0, 0.0005f));
  EXPECT_NEAR(p.x, 0, 0.005 * 0.001 * distance / lens.image_distance());
  EXPECT_NEAR(q.y, 0, 0.005 * 0.001 * distance / lens.image_distance());
  // A ray through the lens comes back the way it went.
  V3f o, dir, back, back_d;
  const V3f film(0.004f, 0.002f, 0);
  ASSERT_TRUE(lens.to_scene(film, normalize(V3f(0.001f, 0, float(lens.rear())) - film), &o, &dir));
  ASSERT_TRUE(lens.to_film(o + dir * 0.5f, -dir, &back, &back_d));
  const V3f landed = back + back_d * (-back.z / back_d.z);
  EXPECT_NEAR(landed.x, film.x, 2e-6f);
  EXPECT_NEAR(landed.y, film.y, 2e-6f);
}

double irradiance(const LensSystem& lens, float x, int n = 400) {
  double sum = 0;
  KeyedRng rng(9);
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < n; ++k)
      sum += double(
          lens.sample(V2f(x, 0), V2f((float(i) + rng.next()) / float(n), (float(k) + rng.next()) / float(n))).weight);
  return sum / n / n * double(lens.exposure());
}

// A stop alone behind a thin lens that is much wider: film sees a disk of radius a at distance v. In the middle the
// irradiance is pi sin^2 = pi a^2 / (a^2 + v^2) (weights have the cosine of the film and that of the stop); at height x
// Foote's form factor of a disk.
TEST(LensSystem, IrradianceOnTheFilmIsThatOfTheStop) {
  constexpr double f = 0.05, a = 0.004;
  const LensSystem lens(thin_lens(f, 0.03, a), {}, 0.035, 1e30);
  const double v = lens.rear();
  for (const double x : {0.0, 0.005, 0.012}) {
    const double z2 = v * v, r2 = a * a, x2 = x * x;
    const double B = z2 + x2 + r2;
    const double disk = double(pi) / 2 * (1 - (z2 + x2 - r2) / std::sqrt(B * B - 4 * r2 * x2));
    EXPECT_NEAR(irradiance(lens, float(x)) / disk, 1, 0.01) << x;
  }
}

// Mechanical vignetting: two stops of radius a, d apart, no glass to speak of between film and stops. From film height
// x the farther one looks shifted by x d / (v + d) in the plane of the nearer and smaller by v / (v + d): what passes
// is the lens of two circles.
TEST(LensSystem, StopsVignette) {
  constexpr double f = 0.05, a = 0.004, d = 0.02;
  auto s = thin_lens(f, 0.03, a);
  s.back().thickness = d;
  s.push_back({0, 0, 1, a, 0});
  const LensSystem lens(s, {}, 0.035, 1e30);
  const double v = lens.rear();
  for (const double x : {0.002, 0.006, 0.010}) {
    // Area of the overlap, by sums: its cos^4 is nearly that of its middle.
    double sum = 0;
    constexpr int n = 1000;
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < n; ++k) {
        const double px = (2 * (i + 0.5) / n - 1) * a, py = (2 * (k + 0.5) / n - 1) * a;
        const double fx = x + (px - x) * (v + d) / v, fy = py * (v + d) / v;
        if (px * px + py * py > a * a || fx * fx + fy * fy > a * a) continue;
        const double r2 = (px - x) * (px - x) + py * py + v * v;
        sum += v * v / (r2 * r2);
      }
    EXPECT_NEAR(irradiance(lens, float(x)) / (sum * 4 * a * a / n / n), 1, 0.01) << x;
  }
}

TEST(LensSystem, ShapesOfStopsPassTheirAreas) {
  constexpr double f = 0.05;
  const auto through = [&](const ApertureShape& shape) {
    return irradiance(LensSystem(thin_lens(f, 0.02, 0.002), shape, 0.035, 1e30), 0);
  };
  const double round = through({});
  EXPECT_NEAR(through(ApertureShape::square()) / round, 1 / double(pi), 0.01);
  const double pentagon = 2.5 * std::sin(2 * double(pi) / 5) * 0.64;
  EXPECT_NEAR(through(ApertureShape::pentagon()) / round, pentagon / double(pi), 0.01);
  EXPECT_LT(through(ApertureShape::star()), through(ApertureShape::pentagon()));
  ApertureShape half;
  half.kind = ApertureShape::picture;
  half.resolution = V2i(2, 1);
  half.values = {0, 0.5f};
  EXPECT_NEAR(through(half) / round, 0.25, 0.005);
}

TEST(LensSystem, SaysWhatCannotBe) {
  EXPECT_THROW(LensSystem({{0, 0.01, 1, 0.01, 0}}, {}, 0.035, 1), std::invalid_argument);  // no glass
  EXPECT_THROW(LensSystem({{-0.05, 1e-3, 1.5, 0.01, 0}, {0.05, 0, 1, 0.01, 0}}, {}, 0.035, 1), std::invalid_argument);
  EXPECT_THROW(LensSystem(thin_lens(0.05, 0.002, 0), {}, 0.035, 0.1), std::invalid_argument);  // too near
}

}  // namespace
}  // namespace dapple::scene
