// SPDX-License-Identifier: Apache-2.0
#include "dapple/pattern/pattern_mapping.h"

#include <gtest/gtest.h>

#include "dapple/pattern/pattern_program.h"
#include "tests/pattern/texture_points.h"

namespace dapple::pattern {
namespace {

Transform some_transform() {
  return Transform::translate({0.3, -0.2, 0.5}) * Transform::rotate(37, {1, 2, 3}) * Transform::scale({2, 0.5, 1.5});
}

/// The difference of two values of a coordinate that may go round once.
float around(float d, bool cyclic) {
  return cyclic ? d - std::round(d) : d;
}

constexpr int capacity = ShadingPoints::capacity;

/// Values of a PatternPoint2 over a batch.
struct Mapped {
  float s[capacity], t[capacity], dsdx[capacity], dtdx[capacity], dsdy[capacity], dtdy[capacity];
  Mapped(const PatternPoint2& q, const ShadingPoints& points) {
    const PatternProgram program(std::array{q.s, q.t, q.dsdx, q.dtdx, q.dsdy, q.dtdy});
    program.evaluate(points, std::array<PatternProgram::Output, 6>{{{s}, {t}, {dsdx}, {dtdx}, {dsdy}, {dtdy}}});
  }
};

/// Footprints must be the change of s and t when P and u, v move by theirs.
void expect_derivatives(const PatternPoint2& mapping, bool cyclic_s, bool cyclic_t) {
  const float h = 1e-3f;
  const auto points = test::random_points(3, 1);
  const auto forward = std::make_unique<ShadingPoints>(*points), backward = std::make_unique<ShadingPoints>(*points);
  const Mapped c(mapping, *points);
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
    const Mapped f(mapping, *forward), b(mapping, *backward);
    for (int i = 0; i < points->count; ++i) {
      const float ds = around(f.s[i] - b.s[i], cyclic_s) / (2 * h), dt = around(f.t[i] - b.t[i], cyclic_t) / (2 * h);
      const float s = along_x ? c.dsdx[i] : c.dsdy[i], t = along_x ? c.dtdx[i] : c.dtdy[i];
      EXPECT_NEAR(ds, s, 2e-3f + 0.02f * std::abs(s)) << i;
      EXPECT_NEAR(dt, t, 2e-3f + 0.02f * std::abs(t)) << i;
    }
  }
}

TEST(TextureMapping, DerivativesMatchFiniteDifferences) {
  PatternGraph graph;
  expect_derivatives(uv_mapping(graph, 2, -3, 0.25f, 7), false, false);
  expect_derivatives(spherical_mapping(graph, some_transform()), false, true);
  expect_derivatives(cylindrical_mapping(graph, some_transform()), true, false);
  expect_derivatives(planar_mapping(graph, some_transform(), {1, 2, 0}, {0, 0.5f, -1}, 0.1f, 0.2f), false, false);
}

TEST(TextureMapping, PlacesOfThePoles) {
  const auto points = test::random_points(1, 1);
  const V3f at[] = {{0, 0, 2}, {0, 0, -2}, {3, 0, 0}, {0, 3, 0}, {-3, 0, 0}, {0, -3, 0}, {0, 0, 0}};
  points->count = static_cast<int>(std::size(at));
  for (int i = 0; i < points->count; ++i) points->P.set(i, at[i]);
  PatternGraph graph;
  const Mapped c(spherical_mapping(graph, Transform()), *points);
  EXPECT_EQ(c.s[0], 0);
  EXPECT_EQ(c.s[1], 1);
  EXPECT_FLOAT_EQ(c.s[2], 0.5f);
  EXPECT_FLOAT_EQ(c.t[2], 0);
  EXPECT_FLOAT_EQ(c.t[3], 0.25f);
  EXPECT_FLOAT_EQ(c.t[4], 0.5f);
  EXPECT_FLOAT_EQ(c.t[5], 0.75f);
  for (int i = 0; i < points->count; ++i) EXPECT_TRUE(std::isfinite(c.dsdx[i]) && std::isfinite(c.dtdx[i])) << i;
  const Mapped d(cylindrical_mapping(graph, Transform()), *points);
  EXPECT_FLOAT_EQ(d.s[2], 0.5f);
  EXPECT_FLOAT_EQ(d.s[3], 0.75f);
  EXPECT_EQ(d.t[0], 2);
  for (int i = 0; i < points->count; ++i) EXPECT_TRUE(std::isfinite(d.dsdx[i]) && std::isfinite(d.dtdx[i])) << i;
}

TEST(TextureMapping, SolidSpaceIsTheInverseOfTheTexturesTransform) {
  const Transform to_world = some_transform();
  PatternGraph graph;
  const PatternPoint3 q = solid_mapping(graph, to_world.inverse());
  const PatternVector n = shading_normal(graph, to_world.inverse());
  const auto points = test::random_points(4, 1);
  const auto values = [&](const PatternVector& v) {
    auto out = std::make_unique<Lanes3<capacity>>();
    const PatternProgram program(std::array{v.x, v.y, v.z});
    program.evaluate(*points, std::array<PatternProgram::Output, 3>{{{out->x}, {out->y}, {out->z}}});
    return out;
  };
  const auto p = values(q.p), dx = values(q.dpdx), dy = values(q.dpdy), normal = values(n);
  for (int i = 0; i < points->count; ++i) {
    EXPECT_LT(length(to_world.point((*p)[i]) - points->P[i]), 1e-5f);
    EXPECT_LT(length(to_world.vector((*dx)[i]) - points->dPdx[i]), 1e-5f);
    EXPECT_LT(length(to_world.vector((*dy)[i]) - points->dPdy[i]), 1e-5f);
    EXPECT_LT(length(normalize(to_world.normal((*normal)[i])) - points->Ns[i]), 1e-5f);
    EXPECT_NEAR(length((*normal)[i]), 1, 1e-5f);
  }
}

}  // namespace
}  // namespace dapple::pattern
