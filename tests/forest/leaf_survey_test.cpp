// SPDX-License-Identifier: Apache-2.0
#include "dapple/forest/leaf_survey.h"

#include <gtest/gtest.h>

#include <numbers>

#include "dapple/base/hash.h"

namespace dapple::forest {
namespace {

LeafSurvey::Frame frame(std::vector<double> edges, int inclinations = 9) {
  return {Box2f(V2f(-1, -1), V2f(1, 1)), std::move(edges), inclinations, 2};
}

// Rationale: areas between two heights have closed forms. Expectation: those, to 1e-12: a slanted rectangle, and a disk
// whose segments are acos(x) - x sqrt(1 - x^2).
TEST(LeafSurvey, CutsAtSlabs) {
  LeafSurvey s(frame({0, 0.25, 1}));
  const V3d rectangle[4] = {{0, 0, 0}, {0, 0.5, 0}, {0.6, 0.5, 0.8}, {0.6, 0, 0.8}};
  s.add_polygon(0, rectangle, 1);
  EXPECT_NEAR(s.area(0, 0), 0.5 * 0.25 / 0.8, 1e-12);
  EXPECT_NEAR(s.area(1, 0), 0.5 * 0.55 / 0.8, 1e-12);
  EXPECT_NEAR(s.area(1, 5, 0), s.area(1, 0), 1e-12) << "inclined by 53 degrees";

  const double r = 0.3;
  const V3d n(0.6, 0, 0.8);
  s.add_disk(1, {0.1, 0.2, 0.3}, r, n, 0.5);
  const double x = (0.3 - 0.25) / (r * 0.6), segment = std::acos(x) - x * std::sqrt(1 - x * x);
  EXPECT_NEAR(s.area(0, 1), 0.5 * r * r * segment, 1e-12);
  EXPECT_NEAR(s.area(1), 0.5 * std::numbers::pi * r * r, 1e-12);
}

// Rationale: what lies in the plane of an edge, or beyond the slabs. Expectation: the slab above; the last slab on that
// side; nothing twice.
TEST(LeafSurvey, EdgesAndBeyond) {
  LeafSurvey s(frame({0, 1, 2}));
  const auto square = [&s](double z) {
    const V3d corners[4] = {{0, 0, z}, {0.5, 0, z}, {0.5, 0.5, z}, {0, 0.5, z}};
    s.add_polygon(0, corners, 1);
    s.add_disk(1, {0, 0, z}, 0.5, {0, 0, 1}, 1);
  };
  square(1);
  EXPECT_EQ(s.area(0, 0), 0);
  EXPECT_EQ(s.area(1, 0), 0.25);
  EXPECT_NEAR(s.area(1, 1), std::numbers::pi / 4, 1e-12);
  square(-5), square(7);
  EXPECT_EQ(s.area(0, 0), 0.25);
  EXPECT_EQ(s.area(1, 0), 0.5);
  EXPECT_NEAR(s.area(1), 3 * std::numbers::pi / 4, 1e-12);
}

// Rationale: the plot's border. Expectation: a polygon over a corner of the plot counts its part in it; a disk half
// outside counts half, to the 256-gon's 1e-4.
TEST(LeafSurvey, CutsAtThePlot) {
  LeafSurvey s(frame({0, 1}));
  const V3d square[4] = {{0.5, 0.5, 0.5}, {1.5, 0.5, 0.5}, {1.5, 1.5, 0.5}, {0.5, 1.5, 0.5}};
  s.add_polygon(0, square, 1);
  EXPECT_NEAR(s.area(0), 0.25, 1e-12);
  s.add_disk(1, {1, 0, 0.5}, 0.4, {0, 0, 1}, 1);
  EXPECT_NEAR(s.area(1), 0.08 * std::numbers::pi, 1e-4 * 0.08 * std::numbers::pi);
}

// Rationale: cutting loses nothing. Expectation: 1000 random triangles and disks within the plot have the same area in
// 1 slab and in 37, and their inclinations add up to it.
TEST(LeafSurvey, SlabsAddUp) {
  std::vector<double> edges;
  for (int i = 0; i <= 37; ++i) edges.push_back(i / 37.0);
  LeafSurvey one(frame({0, 1})), many(frame(edges, 18));
  KeyedRng rng(4);
  const auto point = [&rng] { return V3d(1.2 * rng.next() - 0.6, 1.2 * rng.next() - 0.6, rng.next()); };
  for (int i = 0; i < 1000; ++i) {
    const V3d triangle[3] = {point(), point(), point()}, c = point();
    const V3d n = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalized();
    for (LeafSurvey* s : {&one, &many}) s->add_polygon(0, triangle, 1), s->add_disk(1, c, 0.3, n, 1);
  }
  for (int kind : {0, 1}) EXPECT_NEAR(many.area(kind), one.area(kind), 1e-10 * one.area(kind));
  EXPECT_NEAR(one.area(1), 1000 * std::numbers::pi * 0.09, 1e-8);
}

TEST(LeafSurvey, WrongFrames) {
  EXPECT_THROW(LeafSurvey(frame({0})), std::invalid_argument);
  EXPECT_THROW(LeafSurvey(frame({0, 0})), std::invalid_argument);
  EXPECT_THROW(LeafSurvey(frame({0, 1}, 0)), std::invalid_argument);
}

}  // namespace
}  // namespace dapple::forest
