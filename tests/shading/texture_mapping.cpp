// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/texture_mapping.h"

#include <gtest/gtest.h>

#include "tests/shading/texture_points.h"

namespace dapple::shading {
namespace {

Transform some_transform() {
  return Transform::translate({0.3, -0.2, 0.5}) * Transform::rotate(37, {1, 2, 3}) * Transform::scale({2, 0.5, 1.5});
}

/// The difference of two values of a coordinate that may go round once.
float around(float d, bool cyclic) {
  return cyclic ? d - std::round(d) : d;
}

/// Footprints must be the change of s and t when P and u, v move by theirs.
void expect_derivatives(const TextureMapping2& mapping, bool cyclic_s, bool cyclic_t) {
  const float h = 1e-3f;
  const auto points = test::random_points(3, 1);
  const auto forward = std::make_unique<ShadingPoints>(*points), backward = std::make_unique<ShadingPoints>(*points);
  TextureCoordinates2 c, f, b;
  mapping.map(*points, &c);
  for (const bool along_x : {true, false}) {
    for (int i = 0; i < points->count; ++i) {
      const V3f step = (along_x ? points->dPdx[i] : points->dPdy[i]) * h;
      const float du = (along_x ? points->dudx[i] : points->dudy[i]) * h;
      const float dv = (along_x ? points->dvdx[i] : points->dvdy[i]) * h;
      forward->P.set(i, points->P[i] + step);
      backward->P.set(i, points->P[i] - step);
      forward->u[i] = points->u[i] + du, backward->u[i] = points->u[i] - du;
      forward->v[i] = points->v[i] + dv, backward->v[i] = points->v[i] - dv;
    }
    mapping.map(*forward, &f);
    mapping.map(*backward, &b);
    for (int i = 0; i < points->count; ++i) {
      const float ds = around(f.s[i] - b.s[i], cyclic_s) / (2 * h), dt = around(f.t[i] - b.t[i], cyclic_t) / (2 * h);
      const float s = along_x ? c.dsdx[i] : c.dsdy[i], t = along_x ? c.dtdx[i] : c.dtdy[i];
      EXPECT_NEAR(ds, s, 2e-3f + 0.02f * std::abs(s)) << i;
      EXPECT_NEAR(dt, t, 2e-3f + 0.02f * std::abs(t)) << i;
    }
  }
}

TEST(TextureMapping, DerivativesMatchFiniteDifferences) {
  expect_derivatives(UvMapping(2, -3, 0.25f, 7), false, false);
  expect_derivatives(SphericalMapping(some_transform()), false, true);
  expect_derivatives(CylindricalMapping(some_transform()), true, false);
  expect_derivatives(PlanarMapping(some_transform(), {1, 2, 0}, {0, 0.5f, -1}, 0.1f, 0.2f), false, false);
}

TEST(TextureMapping, PlacesOfThePoles) {
  const auto points = test::random_points(1, 1);
  const V3f at[] = {{0, 0, 2}, {0, 0, -2}, {3, 0, 0}, {0, 3, 0}, {-3, 0, 0}, {0, -3, 0}, {0, 0, 0}};
  points->count = static_cast<int>(std::size(at));
  for (int i = 0; i < points->count; ++i) points->P.set(i, at[i]);
  TextureCoordinates2 c;
  SphericalMapping(Transform()).map(*points, &c);
  EXPECT_EQ(c.s[0], 0);
  EXPECT_EQ(c.s[1], 1);
  EXPECT_FLOAT_EQ(c.s[2], 0.5f);
  EXPECT_FLOAT_EQ(c.t[2], 0);
  EXPECT_FLOAT_EQ(c.t[3], 0.25f);
  EXPECT_FLOAT_EQ(c.t[4], 0.5f);
  EXPECT_FLOAT_EQ(c.t[5], 0.75f);
  for (int i = 0; i < points->count; ++i) EXPECT_TRUE(std::isfinite(c.dsdx[i]) && std::isfinite(c.dtdx[i])) << i;
  CylindricalMapping(Transform()).map(*points, &c);
  EXPECT_FLOAT_EQ(c.s[2], 0.5f);
  EXPECT_FLOAT_EQ(c.s[3], 0.75f);
  EXPECT_EQ(c.t[0], 2);
  for (int i = 0; i < points->count; ++i) EXPECT_TRUE(std::isfinite(c.dsdx[i]) && std::isfinite(c.dtdx[i])) << i;
}

TEST(TextureMapping, SolidSpaceIsTheInverseOfTheTexturesTransform) {
  const Transform to_world = some_transform();
  const TextureMapping3 mapping(to_world.inverse());
  const auto points = test::random_points(4, 1);
  for (int i = 0; i < points->count; ++i) {
    const TexturePoint3 q = mapping.map(*points, i);
    EXPECT_LT(length(to_world.point(q.p) - points->P[i]), 1e-5f);
    EXPECT_LT(length(to_world.vector(q.dpdx) - points->dPdx[i]), 1e-5f);
    EXPECT_LT(length(to_world.vector(q.dpdy) - points->dPdy[i]), 1e-5f);
  }
}

}  // namespace
}  // namespace dapple::shading
