// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "dapple/geom/loop_subdivision.h"
#include "dapple/geom/patch_surface.h"
#include "tests/support/cages.h"

namespace dapple::geom {
namespace {

using test::cube_cage;
using test::plane_cage;

PatchSample sample(const PatchSurface& surface, uint32_t patch, float u, float v) {
  const PatchTopology::Patch& p = surface.topology().patches[patch];
  PatchSample s;
  const V2f at(u, v);
  surface.face(p.face)->evaluate(p.sub, {&at, 1}, &s);
  return s;
}

void expect_near(const V3f& a, const V3f& b, float tolerance) {
  EXPECT_LT(length(a - b), tolerance) << a << " " << b;
}

// A cube over [-1, 1]^3.
ControlCage centred_cube() {
  ControlCage cage = cube_cage();
  for (V3f& p : cage.P) p = p * 2.0f - V3f(1, 1, 1);
  return cage;
}

// The limit of a vertex v of valence n with edge neighbours e and opposite corners f: (n^2 v + 4 sum e + sum f) / (n (n
// + 5)) (Halstead, Kass and DeRose 1993). For a corner of the cube: (9 + 4 - 1) / 24 = 1 / 2 of it.
TEST(CatmullClark, LimitOfAVertexOfValenceThree) {
  const ControlCage cage = centred_cube();
  const auto surface = make_patch_surface(cage);
  const V2f corner[4] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (uint32_t p = 0; p < 6; ++p)
    for (int c = 0; c < 4; ++c) {
      const V3f v = cage.P[cage.indices[p * 4 + uint32_t(c)]];
      const PatchSample s = sample(*surface, p, corner[c].x, corner[c].y);
      expect_near(s.P, v * 0.5f, 1e-6f);
      expect_near(s.N, normalize(v), 1e-5f);
    }
}

// A sharp crease is the cubic B-spline of its vertices: a square loop's at a vertex (p0 + 4 p1 + p2) / 6 and half way
// between (p0 + 23 p1 + 23 p2 + p3) / 48.
TEST(CatmullClark, SharpCreaseIsABSpline) {
  ControlCage cage = centred_cube();
  std::vector<uint32_t> top;  // the loop around the face at z = 1
  uint32_t top_face = 0;
  for (uint32_t f = 0; f < 6; ++f) {
    const uint32_t* c = &cage.indices[f * 4];
    if (cage.P[c[0]].z + cage.P[c[1]].z + cage.P[c[2]].z + cage.P[c[3]].z == 4) top.assign(c, c + 4), top_face = f;
  }
  for (size_t i = 0; i < 4; ++i) {
    cage.crease_edges.insert(cage.crease_edges.end(), {top[i], top[(i + 1) % 4]});
    cage.crease_sharpness.push_back(10);
  }
  const auto surface = make_patch_surface(cage);
  const auto p = [&](int i) { return cage.P[top[size_t(i + 4) % 4]]; };
  expect_near(sample(*surface, top_face, 0, 0).P, (p(-1) + p(0) * 4.0f + p(1)) * (1 / 6.0f), 1e-6f);
  expect_near(sample(*surface, top_face, 1, 1).P, (p(1) + p(2) * 4.0f + p(3)) * (1 / 6.0f), 1e-6f);
  expect_near(sample(*surface, top_face, 0.5f, 0).P, (p(-1) + p(0) * 23.0f + p(1) * 23.0f + p(2)) * (1 / 48.0f), 1e-6f);
}

V3f cubic_b_spline(const V3f p[4], float t, bool derivative) {
  const float s = 1 - t;
  if (derivative)
    return p[0] * (-s * s / 2) + p[1] * ((9 * t * t - 12 * t) / 6) + p[2] * ((-9 * t * t + 6 * t + 3) / 6) +
           p[3] * (t * t / 2);
  return p[0] * (s * s * s / 6) + p[1] * ((3 * t * t * t - 6 * t * t + 4) / 6) +
         p[2] * ((-3 * t * t * t + 3 * t * t + 3 * t + 1) / 6) + p[3] * (t * t * t / 6);
}

// Where all valences are 4 the surface is the bicubic B-spline of 4 x 4 vertices.
TEST(CatmullClark, RegularFaceIsABicubicBSpline) {
  ControlCage cage = plane_cage(3, 3);
  KeyedRng rng(1);
  for (V3f& p : cage.P) p += V3f(rng.next() - .5f, rng.next() - .5f, 2 * rng.next());
  const auto surface = make_patch_surface(cage);
  for (int i = 0; i < 100; ++i) {
    const float u = rng.next(), v = rng.next();
    V3f rows[4], du_rows[4];
    for (int y = 0; y < 4; ++y)
      rows[y] = cubic_b_spline(&cage.P[size_t(y) * 4], u, false),
      du_rows[y] = cubic_b_spline(&cage.P[size_t(y) * 4], u, true);
    const PatchSample s = sample(*surface, 4, u, v);
    expect_near(s.P, cubic_b_spline(rows, v, false), 1e-5f);
    expect_near(s.dPdu, cubic_b_spline(du_rows, v, false), 1e-5f);
    expect_near(s.dPdv, cubic_b_spline(rows, v, true), 1e-5f);
  }
}

TEST(CatmullClark, BoundaryRules) {
  ControlCage cage = plane_cage(3, 3);
  cage.boundary = BoundaryRule::edge_and_corner;
  expect_near(sample(*make_patch_surface(cage), 0, 0, 0).P, V3f(0, 0, 0), 1e-6f);
  cage.boundary = BoundaryRule::edge_only;  // the corner of the border's B-spline: (p0 + 4 p1 + p2) / 6
  expect_near(sample(*make_patch_surface(cage), 0, 0, 0).P, V3f(1, 1, 0) * (1 / 6.0f), 1e-6f);
  cage.boundary = BoundaryRule::none;  // only the middle face has all its neighbours
  EXPECT_EQ(make_patch_surface(cage)->topology().patches.size(), 1u);
}

TEST(CatmullClark, HolesShapeTheirNeighbours) {
  ControlCage cage = centred_cube();
  const auto whole = make_patch_surface(cage);
  cage.holes = {2};
  const auto surface = make_patch_surface(cage);
  EXPECT_EQ(surface->topology().patches.size(), 5u);
  expect_near(sample(*surface, 2, 0.3f, 0.4f).P, sample(*whole, 3, 0.3f, 0.4f).P, 1e-7f);
}

// A pentagon's five patches meet: the sides between them and along the face's edges agree, also with the quad beside
// it.
TEST(CatmullClark, PatchesOfAPentagonMeet) {
  const ControlCage cage = test::figure_cage();
  const auto surface = make_patch_surface(cage);
  const auto& t = surface->topology();
  std::map<std::pair<uint32_t, int>, V3f> at_quarter;  // of each edge, by eighths
  int compared = 0;
  for (uint32_t p = 0; p < t.patches.size(); ++p)
    for (int k = 0; k < 4; ++k)
      for (int j = 0; j <= 4; ++j) {
        const auto& side = t.patches[p].side[k];
        const float f = float(j) / 4;
        const V2f at = k == 0 ? V2f(f, 0) : k == 1 ? V2f(1, f) : k == 2 ? V2f(f, 1) : V2f(0, f);
        const int begin = side.part == 2 ? 4 : 0, end = side.part == 1 ? 4 : 8, step = side.part ? 1 : 2;
        const int place = side.reversed ? end - j * step : begin + j * step;
        const V3f P = sample(*surface, p, at.x, at.y).P;
        const auto [known, is_new] = at_quarter.emplace(std::pair(side.edge, place), P);
        if (is_new) continue;
        expect_near(P, known->second, 1e-4f);
        ++compared;
      }
  EXPECT_GT(compared, 400);
}

// The limit of a vertex of valence n: (1 - n x) v + x sum of its neighbours, x = 1 / (n + 3 / (8 b)),
// b = (5/8 - (3/8 + cos(2 pi / n) / 4)^2) / n (Loop 1987). Octahedron: n = 4, the neighbours' sum is 0.
TEST(Loop, LimitOfAnOctahedronsVertex) {
  ControlCage cage;
  cage.scheme = SurfaceScheme::loop;
  cage.P = {V3f(1, 0, 0), V3f(0, 1, 0), V3f(-1, 0, 0), V3f(0, -1, 0), V3f(0, 0, 1), V3f(0, 0, -1)};
  cage.indices = {0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4, 1, 0, 5, 2, 1, 5, 3, 2, 5, 0, 3, 5};
  cage.face_sizes.assign(8, 3);
  const auto surface = make_patch_surface(cage);
  ASSERT_EQ(surface->topology().patches.size(), 24u);
  const double b = (5.0 / 8 - 9.0 / 64) / 4, x = 1 / (4 + 3 / (8 * b));
  for (uint32_t p = 0; p < 24; ++p) {
    const V3f v = cage.P[cage.indices[p]];
    const PatchSample s = sample(*surface, p, 0, 0);
    expect_near(s.P, v * float(1 - 4 * x), 1e-5f);
    expect_near(s.N, v, 1e-4f);
  }
  // And it is the same surface as uniform refinement gives, at the corners, the edges' middles and everywhere else
  // between.
  const Mesh refined = subdivide_loop(cage.P, cage.indices, 5);
  for (uint32_t p = 0; p < 24; ++p) {
    float nearest = infinity;
    const PatchSample s = sample(*surface, p, 1, 0);
    for (const V3f& q : refined.P) nearest = std::min(nearest, length(q - s.P));
    EXPECT_LT(nearest, 1e-4f);
  }
}

TEST(Cage, CleaningLeavesOutWhatHasNoSurface) {
  ControlCage cage = cube_cage();
  const size_t good = cage.face_count();
  cage.indices.insert(cage.indices.end(), {0, 1, 0, 2});  // a vertex twice
  cage.face_sizes.push_back(4);
  cage.indices.insert(cage.indices.end(), {0, 1});
  cage.face_sizes.push_back(2);
  for (uint32_t i = 0; i < 5000; ++i) cage.indices.push_back(i % 8);
  cage.face_sizes.push_back(5000);
  cage.indices.insert(cage.indices.end(), cage.indices.begin(), cage.indices.begin() + 4);  // keeps its number
  cage.face_sizes.push_back(4);
  cage.crease_edges = {cage.indices[0], cage.indices[2], cage.indices[0], cage.indices[1]};
  cage.crease_sharpness = {3, 4};
  const auto flaws = cage.clean();
  EXPECT_EQ(cage.face_count(), good + 1);
  EXPECT_EQ(cage.face_numbers.back(), good + 3);
  EXPECT_EQ(cage.crease_sharpness, std::vector<float>{4});
  EXPECT_GE(flaws.size(), 4u);
}

// A quad around a pole is a triangle, and its other corners keep their texture coordinates.
TEST(Cage, CornersThatRepeatAreJoined) {
  ControlCage cage;
  cage.P = {V3f(0, 0, 0), V3f(1, 0, 0), V3f(0, 1, 0)};
  cage.indices = {0, 0, 1, 2, 2, 1, 0, 2};
  cage.uv_indices = {0, 1, 2, 3, 4, 5, 6, 7};
  cage.face_sizes = {4, 4};
  EXPECT_TRUE(cage.clean().empty());
  EXPECT_EQ(cage.face_sizes, (std::vector<uint32_t>{3, 3}));
  EXPECT_EQ(cage.indices, (std::vector<uint32_t>{0, 1, 2, 2, 1, 0}));
  EXPECT_EQ(cage.uv_indices, (std::vector<uint32_t>{1, 2, 3, 4, 5, 6}));
}

// The surface, its texture coordinates and normals stay; parts are numbered within their face.
TEST(Cage, SplittingKeepsTheSurface) {
  for (const bool uv_by_corner : {false, true}) {
    ControlCage cage;
    cage.scheme = SurfaceScheme::polygons;
    cage.P = {V3f(0, 0, 0), V3f(2, 0, 0), V3f(2, 1, 1), V3f(0, 1, 0), V3f(1, 3, 0)};
    cage.indices = {0, 1, 2, 3, 3, 2, 4};
    cage.face_sizes = {4, 3};
    for (const V3f& p : cage.P) cage.uv.push_back(V2f(p.x / 2, p.y));
    if (uv_by_corner) cage.uv_indices = cage.indices;
    const auto whole = make_patch_surface(cage);
    cage.split(1024);
    EXPECT_EQ(cage.face_count(), 448u);
    const auto split = make_patch_surface(cage);
    std::set<std::pair<uint32_t, uint32_t>> numbers;
    for (uint32_t p = 0; p < 448; ++p) {
      numbers.emplace(cage.face_numbers[p], cage.sub_numbers[p]);
      const PatchSample s = sample(*split, p, 0.3f, 0.6f);
      EXPECT_NEAR(s.uv.x, s.P.x / 2, 1e-6f);
      EXPECT_NEAR(s.uv.y, s.P.y, 1e-6f);
      if (cage.face_numbers[p] != 0) continue;
      const PatchSample w = sample(*whole, 0, s.P.x / 2, s.P.y);
      expect_near(s.P, w.P, 1e-6f);
      expect_near(s.N, w.N, 0.01f);
    }
    EXPECT_EQ(numbers.size(), 448u);
  }
}

TEST(Cage, WeldingJoinsCopies) {
  ControlCage cage;
  cage.scheme = SurfaceScheme::polygons;
  cage.P = {V3f(0, 0, 0), V3f(1, 0, 0), V3f(0, 1, 0), V3f(1, 0, -0.0f), V3f(1, 1, 0), V3f(-0.0f, 1, 0)};
  cage.uv = {V2f(0, 0), V2f(1, 0), V2f(0, 1), V2f(.1f, 0), V2f(.2f, 1), V2f(.3f, 1)};
  cage.indices = {0, 1, 2, 3, 4, 5};
  cage.face_sizes = {3, 3};
  cage.weld();
  EXPECT_EQ(cage.P.size(), 4u);
  EXPECT_EQ(cage.indices, (std::vector<uint32_t>{0, 1, 2, 1, 3, 2}));
  EXPECT_EQ(cage.uv_indices, (std::vector<uint32_t>{0, 1, 2, 3, 4, 5}));
}

}  // namespace
}  // namespace dapple::geom
