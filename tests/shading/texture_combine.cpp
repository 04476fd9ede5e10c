// SPDX-License-Identifier: Apache-2.0
#include "dapple/shading/texture_combine.h"

#include <gtest/gtest.h>

#include "tests/shading/texture_points.h"

namespace dapple::shading {
namespace {

using test::random_points;
using test::value_at;

/// u, counting its evaluations.
class Ramp final : public FloatTexture {
 public:
  void evaluate(const ShadingPoints& points, float* out) const override {
    ++evaluations;
    std::copy_n(points.u, points.count, out);
  }
  mutable int evaluations = 0;
};

TEST(Combine, ConstantsFold) {
  const auto two = make_constant(2.0f), three = make_constant(3.0f), half = make_constant(0.5f);
  const auto ramp = std::make_shared<Ramp>();
  EXPECT_EQ(make_scale<float>(two, three)->constant(), 6);
  EXPECT_EQ(make_mix<float>(two, three, half)->constant(), 2.5f);
  EXPECT_EQ(make_mix<float>(two, two, ramp)->constant(), 2);
  EXPECT_EQ(make_direction_mix<float>(two, two, {0, 0, 1})->constant(), 2);
  EXPECT_EQ(make_scale<float>(ramp, make_constant(1.0f)), ramp);
  EXPECT_EQ(make_mix<float>(ramp, two, make_constant(0.0f)), ramp);
  EXPECT_EQ(make_mix<float>(two, ramp, make_constant(1.0f)), ramp);
  EXPECT_FALSE(make_scale<float>(ramp, two)->constant());
  EXPECT_EQ(make_scale<RGB>(make_constant(RGB(1, 2, 3)), two)->constant(), RGB(2, 4, 6));
}

TEST(Combine, Values) {
  const auto ramp = std::make_shared<Ramp>();
  const auto nine = make_constant(9.0f);
  EXPECT_EQ(value_at(*make_scale<float>(nine, ramp), 0.5f, 0), 4.5f);
  EXPECT_EQ(value_at(*make_mix<float>(nine, make_constant(1.0f), ramp), 0.25f, 0), 7);
  const BilerpTexture<float> bilerp(std::make_shared<UvMapping>(), 1, 2, 3, 4);
  EXPECT_EQ(value_at(bilerp, 0, 0), 1);
  EXPECT_EQ(value_at(bilerp, 0, 1), 2);
  EXPECT_EQ(value_at(bilerp, 1, 0), 3);
  EXPECT_EQ(value_at(bilerp, 1, 1), 4);
  EXPECT_EQ(value_at(bilerp, 0.5f, 0.5f), 2.5f);
}

TEST(Combine, DirectionMixFollowsTheNormal) {
  const auto mix = make_direction_mix<float>(make_constant(1.0f), make_constant(0.0f), {0, 0, 1});
  const auto points = random_points(2, 0);
  float out[ShadingPoints::capacity];
  mix->evaluate(*points, out);
  for (int i = 0; i < points->count; ++i) EXPECT_NEAR(out[i], std::abs(points->Ng[i].z), 1e-6f);
}

TEST(Combine, WhatNoPointSeesIsNotEvaluated) {
  const auto ramp = std::make_shared<Ramp>();
  const auto points = random_points(2, 0);
  float zeros[ShadingPoints::capacity] = {}, out[ShadingPoints::capacity];
  evaluate_blend<float>(*points, *make_constant(1.0f), *ramp, zeros, out);
  EXPECT_EQ(ramp->evaluations, 0);
  EXPECT_EQ(out[7], 1);
  zeros[3] = 1;
  evaluate_blend<float>(*points, *make_constant(1.0f), *ramp, zeros, out);
  EXPECT_EQ(ramp->evaluations, 1);
  EXPECT_EQ(out[3], points->u[3]);
}

}  // namespace
}  // namespace dapple::shading
