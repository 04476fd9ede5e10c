// SPDX-License-Identifier: Apache-2.0
#include "dapple/gi/hemisphere.h"

#include <gtest/gtest.h>

#include <functional>
#include <vector>

namespace dapple::gi {
namespace {

struct Arriving {
  RGB L;
  float distance;
};

IrradianceRecord gather(int rays, const std::function<Arriving(const V3f&)>& arriving) {
  const HemisphereStrata strata(rays);
  std::vector<RGB> L;
  std::vector<float> r;
  for (int i = 0; i < strata.count(); ++i) {
    const Arriving a = arriving(strata.direction(i, 0.5f, 0.5f));
    L.push_back(a.L), r.push_back(a.distance);
  }
  return integrate_hemisphere(strata, L.data(), r.data());
}

TEST(Hemisphere, StrataAreOfTheNumberAskedForAndCosineWeighted) {
  for (const int rays : {1, 2, 4, 16, 64, 100, 256, 1024}) {
    const HemisphereStrata strata(rays);
    EXPECT_NEAR(strata.count(), rays, 0.13 * rays + 0.5);
    double cosine = 0;
    for (int i = 0; i < strata.count(); ++i)
      for (const float x : {0.125f, 0.375f, 0.625f, 0.875f}) {
        const V3f d = strata.direction(i, x, 0.3f);
        EXPECT_NEAR(length(d), 1, 1e-5);
        cosine += d.z;
      }
    EXPECT_NEAR(cosine / (4 * strata.count()), 2.0 / 3, 0.02) << rays;  // the mean of cos over cos / pi
  }
}

// Radiance 1 + a.d from above, none from below: E(n) = integral of (1 + a.d) (n.d) over the directions above that n
// faces. Its slope with n along a tangent is that of pi (1 + 2/3 a.n).
TEST(Hemisphere, TurnsOfTheNormalInLinearLight) {
  const V3f a(0.3f, -0.2f, 0.4f);
  const auto record = gather(4096, [&](const V3f& d) { return Arriving{RGB(1 + dot(a, d)), infinity}; });
  EXPECT_NEAR(record.E.g, pi * (1 + 2.0f / 3 * a.z), 1e-3);
  EXPECT_NEAR(record.by_normal[0].g, 2 * pi / 3 * a.x, 0.01);
  EXPECT_NEAR(record.by_normal[1].g, 2 * pi / 3 * a.y, 0.01);
  EXPECT_EQ(record.by_place[0], RGB());  // what is at infinity stays where it is
  EXPECT_EQ(record.distance, infinity);
}

// A small light: irradiance is linear in the normal, for turns of any size that still see it.
TEST(Hemisphere, TurnsOfTheNormalUnderASmallLight) {
  const V3f to = normalize(V3f(0.4f, 0.2f, 1));
  const auto record = gather(65536, [&](const V3f& d) {
    return Arriving{RGB(dot(d, to) > 0.995f ? 100.0f : 0.0f), 3};
  });
  for (const V3f& n : {V3f(0.5f, 0, 1), V3f(-0.6f, 0.1f, 1), V3f(0, -0.3f, 1), V3f(0.4f, 0.2f, 1)}) {
    const V3f turned = normalize(n);
    EXPECT_NEAR(record.at(0, 0, turned).g / record.E.g, dot(turned, to) / to.z, 0.03) << n.x << " " << n.y;
  }
}

// Half of the sky above, nothing below: E(n) = pi (1 + cos) / 2.
TEST(Hemisphere, TurnsOfTheNormalUnderAUniformSky) {
  const auto record = gather(4096, [](const V3f&) { return Arriving{RGB(1), infinity}; });
  for (const float angle : {10, 20, 30, 40}) {
    const V3f n(std::sin(radians(angle)), 0, std::cos(radians(angle)));
    EXPECT_NEAR(record.at(0, 0, n).g, pi * (1 + n.z) / 2, 0.03) << angle;
  }
}

// Under a ceiling whose radiance grows along x, irradiance grows as much.
TEST(Hemisphere, MovesUnderACeilingOfLinearLight) {
  const float height = 2, growth = 0.1f;
  const auto record = gather(4096, [&](const V3f& d) {
    return Arriving{RGB(3 + growth * height * d.x / d.z), height / d.z};
  });
  EXPECT_NEAR(record.E.g, 3 * pi, 1e-3);
  EXPECT_NEAR(record.by_place[0].g, pi * growth, 0.03 * pi * growth);
  EXPECT_NEAR(record.by_place[1].g, 0, 1e-3);
  EXPECT_NEAR(record.distance, height, 0.02f);
}

// A square that shines, on one side of the sky: against differences of its irradiance by summation over its area.
TEST(Hemisphere, MovesUnderASquareLight) {
  const V3f corner(0.5f, -0.4f, 1);
  const float side = 1.2f;
  const auto irradiance = [&](float x, float y) {
    double sum = 0;
    const int n = 400;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        const double px = corner.x + side * (i + 0.5) / n - x, py = corner.y + side * (j + 0.5) / n - y,
                     r2 = px * px + py * py + 1;
        sum += 1 / (r2 * r2);
      }
    return sum * side * side / (n * n);
  };
  const auto record = gather(16384, [&](const V3f& d) {
    const float x = d.x / d.z - corner.x, y = d.y / d.z - corner.y;
    const bool hit = x >= 0 && x <= side && y >= 0 && y <= side;
    return Arriving{RGB(hit ? 1.0f : 0.0f), 1 / d.z};
  });
  EXPECT_NEAR(record.E.g, irradiance(0, 0), 0.01);
  EXPECT_NEAR(record.by_place[0].g, (irradiance(0.01f, 0) - irradiance(-0.01f, 0)) / 0.02, 0.03);
  EXPECT_NEAR(record.by_place[1].g, (irradiance(0, 0.01f) - irradiance(0, -0.01f)) / 0.02, 0.03);
  EXPECT_NEAR(record.at(0.2f, 0.1f, {0, 0, 1}).g, irradiance(0.2f, 0.1f), 0.02);
}

// Light that grows with time, by different shares from different directions; and light that stays, which a fit must not
// take for a change.
TEST(Hemisphere, ChangesWithTime) {
  const HemisphereStrata strata(256);
  std::vector<RGB> grows, stays;
  std::vector<float> r(size_t(strata.count()), infinity), time;
  for (int i = 0; i < strata.count(); ++i) {
    const V3f d = strata.direction(i, 0.5f, 0.5f);
    const int quarter = (i + i / 4) % 4;
    time.push_back((float(quarter * 4 + i / 16 % 4) + 0.5f) / 16 - 0.5f);
    grows.push_back(RGB(1 + (0.4f + 0.3f * d.x + 0.3f * d.z) * time.back()));
    stays.push_back(RGB(d.x > 0 ? 2.0f : 0.5f));
  }
  const auto record = integrate_hemisphere(strata, grows.data(), r.data(), time.data());
  EXPECT_NEAR(record.E.g, pi, 0.01f);
  EXPECT_NEAR(record.by_time.g, pi * (0.4f + 0.3f * 2 / 3), 0.03f);  // the mean of cos over cos / pi is 2/3
  EXPECT_NEAR(record.at(0, 0, V3f(0, 0, 1), 0.5f).g, pi * 1.3f, 0.02f);
  const auto same = integrate_hemisphere(strata, stays.data(), r.data(), time.data());
  EXPECT_NEAR(same.by_time.g, 0, 0.05f * same.E.g);
  EXPECT_EQ(integrate_hemisphere(strata, stays.data(), r.data()).by_time, RGB());
}

TEST(Hemisphere, IsTrustedNoFurtherThanItChangesByItself) {
  const auto record = gather(64, [](const V3f& d) {
    return d.x > 0 ? Arriving{RGB(5), 1e-3f} : Arriving{RGB(), infinity};
  });
  EXPECT_LE(length(V3f(record.by_place[0].r, record.by_place[1].r, 0)), record.E.r / record.distance * 1.0001f);
  EXPECT_LE(record.distance, 1e-3f);
  EXPECT_EQ(record.at(-1, 0, {0, 0, 1}), RGB());
}

TEST(Hemisphere, WhatTouchesIsNoReasonForNaN) {
  const auto record = gather(64, [](const V3f& d) { return Arriving{RGB(d.x > 0 ? 1.0f : 0.5f), 0}; });
  EXPECT_TRUE(record.E.is_finite() && record.by_place[0].is_finite() && record.by_place[1].is_finite());
}

}  // namespace
}  // namespace dapple::gi
