// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "dapple/geom/patch_clusters.h"
#include "dapple/geom/patch_map.h"

namespace dapple::geom {
namespace {

// A strip of n squares along x, each of two triangles; `bend` lifts every second column.
Mesh strip(uint32_t n, float bend = 0) {
  Mesh mesh;
  for (uint32_t i = 0; i <= n; ++i)
    for (uint32_t j = 0; j < 2; ++j) mesh.P.push_back(V3f(float(i), float(j), i % 2 ? bend : 0));
  for (uint32_t i = 0; i < n; ++i) {
    const uint32_t a = 2 * i, b = a + 2, c = a + 3, d = a + 1;
    for (const uint32_t v : {b, c, a, d, a, c}) mesh.indices.push_back(v);
  }
  return mesh;
}

TEST(PatchMap, PairsTrianglesOfASquare) {
  const Mesh mesh = strip(3);
  const PatchMap map(mesh);
  EXPECT_EQ(map.patch_count(), 3u);
  for (uint32_t p = 0; p < 3; ++p) EXPECT_FALSE(map.is_half(p));
  // The two faces meet without a step: (s, t) spans the square affinely.
  const auto at = [&](float s, float t) {
    const auto f = map.face_point(1, s, t);
    return mesh.at(f.face, f.u, f.v, 0).P;
  };
  const V3f origin = at(0, 0), x = at(1, 0) - origin, y = at(0, 1) - origin;
  for (float s : {0.1f, 0.5f, 0.9f})
    for (float t : {0.2f, 0.5f, 0.8f}) EXPECT_LT(length(at(s, t) - (origin + x * s + y * t)), 1e-6f);
}

TEST(PatchMap, LeavesFoldsAndLoneTrianglesAlone) {
  const Mesh folded = strip(1, 0);
  Mesh fold = folded;
  fold.P[1] = V3f(0.5f, 0.5f, 1);  // corner d of the second triangle
  const PatchMap map(fold);
  EXPECT_EQ(map.patch_count(), 2u);
  EXPECT_TRUE(map.is_half(0));
  EXPECT_TRUE(map.is_half(1));
}

RC_GTEST_PROP(PatchMap, MapsThereAndBack, ()) {
  const Mesh mesh = strip(4, 0.3f);
  const PatchMap map(mesh);
  const auto face = *rc::gen::inRange<uint32_t>(0, uint32_t(mesh.face_count()));
  float u = float(*rc::gen::inRange(1, 999)) / 1000, v = float(*rc::gen::inRange(1, 999)) / 1000;
  if (u + v >= 0.999f) u = (1 - u) * 0.999f, v = (1 - v) * 0.999f;
  const auto p = map.patch_point(face, u, v);
  RC_ASSERT(p.s >= 0 && p.s <= 1 && p.t >= 0 && p.t <= 1);
  const auto f = map.face_point(p.patch, p.s, p.t);
  const V3f there = mesh.at(face, u, v, 0).P, back = mesh.at(f.face, f.u, f.v, 0).P;
  RC_ASSERT(length(there - back) < 1e-5f);
}

TEST(PatchMap, CornersAreWhereTheirParametersAre) {
  Mesh fold = strip(2, 0);
  fold.P[1] = V3f(0.5f, 0.5f, 1);  // two halves, then a pair
  Mesh quads;
  quads.corners = 4;
  quads.P = {V3f(0, 0, 0), V3f(2, 0, 1), V3f(3, 1, 0), V3f(0, 2, 0)};
  quads.indices = {0, 1, 2, 3};
  for (const Mesh& mesh : {strip(3, 0.1f), fold, quads}) {
    const PatchMap map(mesh);
    for (uint32_t patch = 0; patch < map.patch_count(); ++patch) {
      V3f corners[4];
      map.corners_at(mesh, patch, 0, corners);
      const float st[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
      for (int c = 0; c < (map.is_half(patch) ? 3 : 4); ++c) {
        const auto f = map.face_point(patch, st[c][0], st[c][1]);
        EXPECT_LT(length(mesh.at(f.face, f.u, f.v, 0).P - corners[c]), 1e-6f) << patch << " " << c;
      }
    }
  }
}

TEST(PatchClusters, GroupsHoldTheirPatchesAndStandInForThem) {
  std::vector<Box3f> boxes;
  for (int i = 0; i < 1000; ++i) {
    const V3f p(float(i % 10), float(i / 10 % 10), float(i / 100));
    boxes.push_back(Box3f(p, p + V3f(0.5f, 0.5f, 0.5f)));
  }
  std::vector<float> areas(1000, 1);
  const PatchClusters clusters(boxes, areas);
  ASSERT_EQ(clusters.levels(), 5);  // 4^5 >= 1000
  for (int k = 1; k <= clusters.levels(); ++k) {
    std::vector<Box3f> groups(1000);
    std::vector<int> sizes(1000);
    for (uint32_t p = 0; p < 1000; ++p) {
      groups[clusters.group(p, k)].extendBy(boxes[p]);
      ++sizes[clusters.group(p, k)];
    }
    for (uint32_t g = 0; g < 1000 && sizes[g]; ++g) {
      EXPECT_LE(sizes[g], 1 << (2 * k));
      EXPECT_FLOAT_EQ(clusters.diameter(g, k), length(groups[g].max - groups[g].min));
      EXPECT_EQ(clusters.group(clusters.representative(g, k, 1), k), g);
      for (int part = 0; part < PatchClusters::parts(k); ++part) {
        uint32_t ends[2];
        if (!clusters.ends_of_part(g, k, part, ends)) continue;
        for (const uint32_t end : ends) {
          EXPECT_EQ(clusters.group(end, k), g);
          EXPECT_EQ(clusters.part(end, k), part);
        }
      }
    }
  }
  // Four neighbours fit a block of 2 x 2 x 1 cells, or of 4 x 1 x 1 where the numbers do not divide.
  for (uint32_t g = 0; g < 250; ++g) EXPECT_LE(clusters.diameter(g, 1), length(V3f(3.5f, 1.5f, 0.5f)) + 1e-5f);
}

TEST(PatchClusters, LargePatchesStandInMoreOften) {
  std::vector<Box3f> boxes;
  std::vector<float> areas;
  for (int i = 0; i < 64; ++i) {
    boxes.push_back(Box3f(V3f(float(i), 0, 0), V3f(float(i) + 1, 1, 0)));
    areas.push_back(i < 8 ? 0 : float(i));
  }
  const PatchClusters clusters(boxes, areas);
  const int draws = 100000;
  std::vector<int> count(64);
  for (int i = 0; i < draws; ++i) ++count[clusters.representative(0, 3, uint32_t(i))];
  const float all = 63 * 32 - 28;
  double chi2 = 0;
  for (int i = 0; i < 64; ++i) {
    if (i < 8) {
      EXPECT_EQ(count[size_t(i)], 0);
      continue;
    }
    const double expected = draws * double(areas[size_t(i)] / all);
    chi2 += sqr(count[size_t(i)] - expected) / expected;
  }
  EXPECT_LT(chi2, 103);  // 55 degrees of freedom: a chance of 1e-4
  // Groups without area have stand-ins all the same.
  EXPECT_LT(clusters.representative(0, 1, 5), 4u);
}

}  // namespace
}  // namespace dapple::geom
