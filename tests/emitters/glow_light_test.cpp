// SPDX-License-Identifier: Apache-2.0
#include "dapple/emitters/glow_light.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/emitters/light_samples.h"

namespace dapple::emitters {
namespace {

GlowCells cells(const Box3f& box, int nx, int ny, int nz, const std::vector<float>& emitted) {
  GlowCells c;
  c.box = box;
  c.nx = nx, c.ny = ny, c.nz = nz;
  c.emitted = emitted;
  const V3f size = box.size();
  for (const float e : emitted) c.intensity += RGB(e * size.x * size.y * size.z / float(emitted.size()));
  return c;
}

const V3f origin(0, 0, 0);

// A long box, dark but for some cells.
GlowLight flames() {
  std::vector<float> first(4 * 2 * 3, 0.0f);
  first[1] = 5, first[13] = 1, first[22] = 9;
  return GlowLight(cells(Box3f(V3f(-1, 0, 1), V3f(1, .6f, 2)), 4, 2, 3, first));
}

TEST(GlowLight, DensityIsThatOfItsSamples) {
  const GlowLight light = flames();
  // Outside, in a bright cell, in a dark one, and under a face.
  const V3f places[] = {V3f(0, 0, 0), V3f(-.3f, .2f, 1.1f), V3f(.8f, .5f, 1.9f), V3f(.3f, .3f, .99f)};
  for (const V3f& p : places) {
    const LightReceiver to{.p = p};
    const auto result = test::chi_square_sphere(
        [&](KeyedRng& rng) -> std::optional<V3f> {
          LightSample s;
          const float u = rng.next(), v = rng.next();
          if (!light.sample(to, V2f(u, v), &s)) return std::nullopt;
          EXPECT_NEAR(s.pdf, light.pdf(to, s.wi, origin, origin), 1e-4f * s.pdf);
          return s.wi;
        },
        [&](const V3f& wi) { return light.pdf(to, wi, origin, origin); });
    EXPECT_GT(result.p_value, test::sidak(.01, 4)) << p << ": " << result.message;
    EXPECT_NEAR(result.integral, 1, .02) << p;
  }
}

TEST(GlowLight, IsFoundWhereverItMayBe) {
  const GlowLight light = flames();
  // Towards cells of which nothing is known to glow, too; and nowhere else.
  EXPECT_GT(light.pdf({.p = V3f(0, 0, 0)}, normalize(V3f(.9f, .1f, 1.9f)), origin, origin), 0);
  EXPECT_EQ(light.pdf({.p = V3f(0, 0, 0)}, V3f(0, 0, -1), origin, origin), 0);
  const auto bounds = light.bounds();
  ASSERT_TRUE(bounds);
  EXPECT_EQ(bounds->box, Box3f(V3f(-1, 0, 1), V3f(1, .6f, 2)));
  EXPECT_NEAR(bounds->intensity, 15 * 1.2f / 24, 1e-4f);
  EXPECT_NEAR(light.power(1), 4 * pi * bounds->intensity, 1e-3f);
}

// As far as the box reaches, so that shadow rays end behind all that glows.
TEST(GlowLight, SamplesReachThroughTheBox) {
  const GlowLight light = flames();
  for (int i = 0; i < 200; ++i) {
    KeyedRng rng(hash(5, i));
    LightSample s;
    ASSERT_TRUE(light.sample({.p = V3f(0, 0, 0)}, V2f(rng.next(), rng.next()), &s));
    EXPECT_TRUE(s.glow);
    const V3f end = s.wi * s.distance;
    const Box3f box = light.bounds()->box;
    EXPECT_TRUE(end.x <= box.min.x || end.x >= box.max.x || end.y <= box.min.y || end.y >= box.max.y ||
                end.z >= box.max.z);
  }
}

}  // namespace
}  // namespace dapple::emitters
