// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "dapple/pattern/pattern_program.h"
#include "dapple/pattern/patterns.h"
#include "tests/pattern/texture_points.h"

namespace dapple::pattern {
namespace {

using test::random_points;
using test::value_at;

/// A texture that is no program: u.
class Ramp final : public FloatTexture {
 public:
  void evaluate(const ShadingPoints& points, float* out) const override { std::copy_n(points.u, points.count, out); }
};

/// (u, v, 2).
class ColorRamp final : public RgbTexture {
 public:
  void evaluate(const ShadingPoints& points, RGB* out) const override {
    for (int i = 0; i < points.count; ++i) out[i] = {points.u[i], points.v[i], 2};
  }
};

TEST(Combine, ConstantsFold) {
  PatternGraph graph;
  const auto number = [&](float v) { return pattern_number(graph, v); };
  const PatternFloat ramp(&graph, graph.foreign(std::make_shared<Ramp>()));
  EXPECT_EQ((number(2) * number(3)).constant(), 6);
  EXPECT_EQ(mix(number(2), number(3), number(0.5f)).constant(), 2.5f);
  EXPECT_EQ(mix(number(2), number(2), ramp).constant(), 2);
  EXPECT_EQ(ramp * 1, ramp);
  EXPECT_EQ(mix(ramp, number(2), number(0)), ramp);
  EXPECT_EQ(mix(number(2), ramp, number(1)), ramp);
  EXPECT_FALSE((ramp * 2).constant());
  EXPECT_EQ((pattern_number(graph, RGB(1, 2, 3)) * number(2)).constant(), RGB(2, 4, 6));
  EXPECT_EQ(make_texture(number(7))->constant(), 7);
  EXPECT_EQ(make_texture(pattern_number(graph, RGB(1, 2, 3)))->constant(), RGB(1, 2, 3));
}

TEST(Combine, Values) {
  PatternGraph graph;
  const PatternFloat ramp(&graph, graph.foreign(std::make_shared<Ramp>()));
  const PatternFloat nine = pattern_number(graph, 9);
  EXPECT_EQ(value_at(*make_texture(nine * ramp), 0.5f, 0), 4.5f);
  EXPECT_EQ(value_at(*make_texture(mix(nine, nine.number(1), ramp)), 0.25f, 0), 7);
  const auto bilinear = make_texture(bilerp(uv_mapping(graph), 1, 2, 3, 4));
  EXPECT_EQ(value_at(*bilinear, 0, 0), 1);
  EXPECT_EQ(value_at(*bilinear, 0, 1), 2);
  EXPECT_EQ(value_at(*bilinear, 1, 0), 3);
  EXPECT_EQ(value_at(*bilinear, 1, 1), 4);
  EXPECT_EQ(value_at(*bilinear, 0.5f, 0.5f), 2.5f);
}

TEST(Combine, DirectionMixFollowsTheNormal) {
  PatternGraph graph;
  const auto mixed = make_texture(facing(graph, {0, 0, 1}));
  const auto points = random_points(2, 0);
  float out[ShadingPoints::capacity];
  mixed->evaluate(*points, out);
  for (int i = 0; i < points->count; ++i) EXPECT_NEAR(out[i], std::abs(points->Ng[i].z), 1e-6f);
}

TEST(Combine, ForeignTexturesAreLeaves) {
  PatternGraph graph;
  const PatternFloat u(&graph, graph.foreign(std::make_shared<Ramp>()));
  const auto c = graph.foreign(std::make_shared<ColorRamp>());
  const PatternFloat sum = u + PatternFloat(&graph, c[1]) * PatternFloat(&graph, c[2]);
  const auto points = random_points(5, 0);
  float out[ShadingPoints::capacity];
  make_texture(sum)->evaluate(*points, out);
  for (int i = 0; i < points->count; ++i) EXPECT_EQ(out[i], points->u[i] + points->v[i] * 2);
}

}  // namespace
}  // namespace dapple::pattern
