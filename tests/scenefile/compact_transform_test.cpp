// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "dapple/scenefile/scene_description.h"

namespace dapple::scenefile {
namespace {

Transform turned(double x) {
  return Transform::translate({x, -2, 3}) * Transform::rotate(30, {1, 2, 3}) * Transform::scale({1, 2, .5});
}

TEST(CompactTransform, IsExactWhereItIsFar) {
  const Transform a = turned(1801.633), b = turned(1e7 + .1), near = turned(18.01633);
  const TransformPair still = CompactTransform({a, a}).exact(), moves = CompactTransform({a, b}).exact();
  EXPECT_EQ(still.start, a);
  EXPECT_FALSE(still.is_animated());
  EXPECT_EQ(moves.start, a);
  EXPECT_EQ(moves.end, b);
  const TransformPair arrives = CompactTransform({b, near}).exact();
  EXPECT_EQ(arrives.start, b);
  EXPECT_EQ(arrives.end, near);
  const V3f p(1, 2, 3), back = still.start.inverse().point(still.start.point(p));
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(back[k], p[k], 1e-3);
}

TEST(CompactTransform, IsRoundedToFloatWhereItIsNear) {
  const Transform near = turned(18.01633);
  const TransformPair got = CompactTransform({near, near}).exact();
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) EXPECT_EQ(got.start.matrix()[r][c], double(float(near.matrix()[r][c])));
}

TEST(CompactTransform, TellsFarPlacesApartThatAreOneInFloat) {
  const Transform a = turned(1e7), b = turned(1e7 + .1), c = turned(5);
  EXPECT_EQ(float(a.matrix()[0][3]), float(b.matrix()[0][3]));
  EXPECT_TRUE(CompactTransform({a, a}) == CompactTransform({a, a}));
  EXPECT_FALSE(CompactTransform({a, a}) == CompactTransform({b, b}));
  EXPECT_FALSE(CompactTransform({a, c}) == CompactTransform({b, c}));
  EXPECT_FALSE(CompactTransform({c, a}) == CompactTransform({c, b}));
  EXPECT_FALSE(CompactTransform({c, c}) == CompactTransform({c, a}));
  EXPECT_FALSE(CompactTransform({c, a}) == CompactTransform({c, c}));
  EXPECT_TRUE(CompactTransform({c, a}) == CompactTransform({c, a}));
}

}  // namespace
}  // namespace dapple::scenefile
