// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/polygon.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "dapple/base/timer.h"
#include "tests/scenefile/support.h"

namespace dapple::scenefile {
namespace {

V3f area_vector(const std::vector<V3f>& P, std::span<const int32_t> corners) {
  V3f sum(0);
  for (size_t i = 2; i < corners.size(); ++i)
    sum += cross(P[size_t(corners[i - 1])] - P[size_t(corners[0])], P[size_t(corners[i])] - P[size_t(corners[0])]);
  return sum * .5f;
}

// A polygon round the origin, its corners at the given distances; tilted out of the coordinate planes.
std::vector<V3f> star(const std::vector<float>& radii) {
  std::vector<V3f> P;
  const Frame frame(normalize(V3f(1, 2, 3)));
  for (size_t i = 0; i < radii.size(); ++i) {
    const float angle = 2 * pi * float(i) / float(radii.size());
    P.push_back(frame.to_world({radii[i] * std::cos(angle), radii[i] * std::sin(angle), 0}));
  }
  return P;
}

std::vector<int32_t> triangulate(const std::vector<V3f>& P) {
  std::vector<int32_t> corners(P.size()), triangles;
  for (size_t i = 0; i < P.size(); ++i) corners[i] = int32_t(i);
  Triangulator().add(corners, P, &triangles);
  return triangles;
}

// Triangles that all face the polygon's way and add up to its area neither overlap nor leave gaps.
void expect_partition(const std::vector<V3f>& P) {
  std::vector<int32_t> corners(P.size());
  for (size_t i = 0; i < P.size(); ++i) corners[i] = int32_t(i);
  const V3f whole = area_vector(P, corners);
  const std::vector<int32_t> triangles = triangulate(P);
  ASSERT_EQ(triangles.size(), 3 * (P.size() - 2));
  float sum = 0;
  for (size_t t = 0; t < triangles.size(); t += 3) {
    const V3f a = area_vector(P, std::span(triangles).subspan(t, 3));
    EXPECT_GE(dot(a, whole), -1e-4f * dot(whole, whole));
    sum += length(a);
  }
  EXPECT_NEAR(sum, length(whole), 1e-3f * length(whole));
}

TEST(Triangulator, ConvexPolygonsBecomeFans) {
  EXPECT_EQ(triangulate(star({1, 1, 1, 1, 1})), (std::vector<int32_t>{0, 1, 2, 0, 2, 3, 0, 3, 4}));
}

TEST(Triangulator, ConcavePolygonsArePartitioned) {
  expect_partition(star({2, .5f, 2, .5f, 2, .5f, 2, .5f}));
  expect_partition({{0, 0, 0}, {4, 0, 0}, {4, 3, 0}, {3, 3, 0}, {3, 1, 0}, {1, 1, 0}, {1, 3, 0}, {0, 3, 0}});  // a U
  expect_partition(
      {{0, 0, 0}, {0, 3, 0}, {1, 3, 0}, {1, 1, 0}, {3, 1, 0}, {3, 3, 0}, {4, 3, 0}, {4, 0, 0}});  // from behind
}

RC_GTEST_PROP(Triangulator, StarShapedPolygonsArePartitioned, (const std::vector<uint8_t>& distances)) {
  RC_PRE(distances.size() >= 5);
  std::vector<float> radii;
  for (const uint8_t d : distances) radii.push_back(.2f + float(d) / 64);
  expect_partition(star(radii));
}

TEST(Triangulator, DegenerateAndHugePolygonsEndInTime) {
  const Timer timer;
  EXPECT_EQ(triangulate(std::vector<V3f>(500, V3f(1, 1, 1))).size(), 3 * 498u);
  std::vector<float> radii;
  for (int i = 0; i < 100001; ++i) radii.push_back(i % 2 ? 1.f : 2.f);
  EXPECT_EQ(triangulate(star(radii)).size(), 3 * 99999u);
  Triangulator shared;
  const std::vector<V3f> P = star(std::vector<float>(radii.begin(), radii.begin() + 1001));
  std::vector<int32_t> corners(P.size()), triangles;
  for (size_t i = 0; i < P.size(); ++i) corners[i] = int32_t(i);
  for (int i = 0; i < 1000; ++i) shared.add(corners, P, &triangles);
  EXPECT_EQ(triangles.size(), 1000 * 3 * 999u);
  EXPECT_LT(timer.seconds(), 20);
}

}  // namespace
}  // namespace dapple::scenefile
