// SPDX-License-Identifier: Apache-2.0
#include "dapple/geom/dicer.h"

#include <gtest/gtest.h>

#include <map>

#include "dapple/base/parallel.h"
#include "tests/support/cages.h"

namespace dapple::geom {
namespace {

using test::cube_cage;
using test::figure_cage;
using test::PatchyView;
using test::plane_cage;
using test::sphere_cage;
using test::Waves;

GridMesh dice_with(ControlCage cage, const DicingView& view, const DiceSettings& settings = {}) {
  cage.clean();
  DiceReport report;
  return dice(*make_patch_surface(std::move(cage)), view, settings, &report);
}

using Bits = std::array<float, 3>;
Bits bits(const V3f& p) {
  return {p.x, p.y, p.z};
}

// How often each directed edge between different positions runs along a triangle, less how often its reverse does. A
// surface without a border is without cracks, exactly, if all are 0.
size_t open_edges(const GridMesh& mesh, const std::vector<V3f>& P) {
  std::map<std::pair<Bits, Bits>, int> balance;
  const auto edge = [&](const V3f& a, const V3f& b) {
    if (a == b) return;
    const Bits x = bits(a), y = bits(b);
    balance[x < y ? std::pair(x, y) : std::pair(y, x)] += x < y ? 1 : -1;
  };
  for (const GridMesh::Grid& g : mesh.grids)
    for (uint32_t y = 0; y + 1 < g.rows; ++y)
      for (uint32_t x = 0; x + 1 < g.columns; ++x) {
        const uint32_t v = g.first + y * g.stride + x, ring[4] = {v, v + 1, v + g.stride + 1, v + g.stride};
        for (const auto& t : {std::array{0, 1, 3}, std::array{2, 3, 1}})
          for (size_t i = 0; i < 3; ++i) edge(P[ring[t[i]]], P[ring[t[(i + 1) % 3]]]);
      }
  size_t open = 0;
  for (const auto& [e, n] : balance) open += n != 0;
  return open;
}

struct Shape {
  const char* name;
  ControlCage cage;
};

std::vector<Shape> closed_shapes() {
  std::vector<Shape> shapes = {{"cube", cube_cage()}, {"figure", figure_cage()}, {"sphere", sphere_cage(9, 6)}};
  for (size_t i = 0; i < 3; ++i) {
    shapes.push_back(shapes[i]);
    shapes.back().cage.scheme = SurfaceScheme::polygons;
  }
  shapes.push_back({"moving figure", figure_cage()});
  shapes.back().cage.P_end = shapes.back().cage.P;
  for (V3f& p : shapes.back().cage.P_end) p = V3f(p.x + 0.2f * p.z, p.y, p.z);
  shapes.push_back({"figure with seams of uv", figure_cage()});
  ControlCage& cage = shapes.back().cage;
  for (uint32_t i = 0; i < cage.indices.size(); ++i) {
    cage.uv.push_back(V2f(float(i % 4 / 2), float(i % 2)));
    cage.uv_indices.push_back(i);
  }
  return shapes;
}

// Creases, corners, triangles and pentagons, rates that change from patch to patch, displaced: every edge has its
// partner, bit for bit.
TEST(Dicer, ClosedSurfacesStayClosed) {
  const PatchyView view(0.02f, 0.7f);
  const Waves waves(0.1f, 5);
  for (const Shape& shape : closed_shapes())
    for (const bool displaced : {false, true}) {
      DiceSettings settings;
      if (displaced) settings.displacement.displacer = &waves;
      const GridMesh mesh = dice_with(shape.cage, view, settings);
      EXPECT_GT(mesh.micropolygon_count(), 500u);
      EXPECT_EQ(open_edges(mesh, mesh.P), 0u) << shape.name << (displaced ? " displaced" : "");
      if (!mesh.P_end.empty()) {
        EXPECT_EQ(open_edges(mesh, mesh.P_end), 0u) << shape.name << " at the end";
      }
    }
}

// What the test above rests on: rates do differ, and without the snapping there would be open edges.
TEST(Dicer, NeighboursHaveDifferentRates) {
  const GridMesh mesh = dice_with(figure_cage(), PatchyView(0.02f, 0.7f));
  std::map<int, int> columns;
  for (const auto& g : mesh.grids) ++columns[g.columns];
  EXPECT_GE(columns.size(), 4u);
  GridMesh torn = mesh;
  torn.P[torn.grids[0].first + 1].x += 1e-6f;
  EXPECT_GT(open_edges(torn, torn.P), 0u);
}

// A plane displaced by f has height f at its vertices, where these are evaluated, and normals of f up to the cells'
// size.
TEST(Dicer, DisplacedPlaneHasTheGivenHeight) {
  const Waves waves(0.05f, 6);
  for (const SurfaceScheme scheme : {SurfaceScheme::polygons, SurfaceScheme::catmull_clark}) {
    ControlCage cage = plane_cage(4, 1);
    cage.scheme = scheme;
    DiceSettings settings;
    settings.displacement.displacer = &waves;
    const GridMesh mesh = dice_with(cage, UniformDicingView(1 / 256.0f), settings);
    for (size_t i = 0; i < mesh.P.size(); ++i) {
      PatchSample s;
      s.P = V3f(mesh.P[i].x, mesh.P[i].y, 0);
      float height;
      waves.heights({&s, 1}, &height);
      ASSERT_NEAR(mesh.P[i].z, height, 2e-7f);
      const float x = 6 * s.P.x, y = 1.3f * 6 * s.P.y + 1, margin = 0.004f;
      const V3f n =
          normalize(V3f(-0.05f * 6 * std::cos(x) * std::sin(y), -0.05f * 6 * 1.3f * std::sin(x) * std::cos(y), 1));
      const bool inside = std::min({s.P.x, s.P.y, 1 - s.P.x, 1 - s.P.y}) > margin;
      ASSERT_GT(dot(mesh.N[i], n), inside ? 0.99999f : 0.999f);
    }
  }
}

TEST(Dicer, HeightsBeyondTheBoundAreClampedAndCounted) {
  class Wild final : public Displacer {
    void heights(std::span<const PatchSample> points, float* heights) const override {
      for (size_t i = 0; i < points.size(); ++i)
        heights[i] = points[i].P.x > 0.5f ? 7.0f : points[i].P.y > 0.5f ? std::nanf("") : 0.5f;
    }
  } const wild;
  ControlCage cage = plane_cage(1, 1);
  cage.scheme = SurfaceScheme::polygons;
  DiceSettings settings;
  settings.displacement = {&wild, 1};
  DiceReport report;
  const GridMesh mesh = dice(*make_patch_surface(cage), UniformDicingView(0.25f), settings, &report);
  size_t clamped = 0;
  for (const V3f& p : mesh.P) {
    clamped += p.x > 0.5f || p.y > 0.5f;
    EXPECT_EQ(p.z, p.x > 0.5f ? 1.0f : p.y > 0.5f ? 0.0f : 0.5f);
  }
  EXPECT_EQ(report.clamped, clamped);
}

// Micropolygons are about shading_rate pixels: sides are the nearest power of two, so areas within a factor of 2 of it
// on a plane.
TEST(Dicer, MicropolygonsAreAboutThePixelsAskedFor) {
  for (const float rate : {0.25f, 1.0f, 3.0f})
    for (const float size : {0.7f, 1.0f, 1.3f}) {
      ControlCage cage = plane_cage(1, size);
      cage.scheme = SurfaceScheme::polygons;
      DiceSettings settings;
      settings.shading_rate = rate;
      const GridMesh mesh = dice_with(cage, UniformDicingView(0.01f), settings);
      const double pixels = double(size) * double(size) / 1e-4, area = pixels / double(mesh.micropolygon_count());
      EXPECT_GE(area, rate * 0.499);
      EXPECT_LE(area, rate * 2.001);
    }
}

// Where a surface is smooth, patches agree about its normals; across a sharp crease they do not.
TEST(Dicer, NormalsAreSharedWhereTheSurfaceIsSmooth) {
  const Waves waves(0.05f, 7);
  DiceSettings settings;
  settings.displacement.displacer = &waves;
  for (const bool displaced : {false, true}) {
    ControlCage cage = cube_cage();
    const DiceSettings& s = displaced ? settings : DiceSettings();
    const auto different = [](const GridMesh& mesh) {
      std::map<Bits, V3f> normal;
      size_t n = 0;
      for (size_t i = 0; i < mesh.P.size(); ++i) {
        EXPECT_NEAR(length(mesh.N[i]), 1, 1e-5f);
        n += normal.emplace(bits(mesh.P[i]), mesh.N[i]).first->second != mesh.N[i];
      }
      return n;
    };
    EXPECT_EQ(different(dice_with(cage, PatchyView(0.01f, 0.3f), s)), 0u);
    cage.crease_edges = {cage.indices[0], cage.indices[1]};
    cage.crease_sharpness = {10};
    const size_t seam = different(dice_with(cage, UniformDicingView(0.03f), s));
    EXPECT_GT(seam, 8u);
    EXPECT_LT(seam, 40u);
  }
}

// Outside is where the corners go round counter-clockwise, or the other side; displacement goes outwards.
TEST(Dicer, DisplacementGoesOutwards) {
  class Out final : public Displacer {
    void heights(std::span<const PatchSample> points, float* heights) const override {
      std::fill_n(heights, points.size(), 0.25f);
    }
  } const out;
  DiceSettings settings;
  settings.displacement.displacer = &out;
  for (const bool flip : {false, true}) {
    ControlCage cage = plane_cage(2, 1);
    cage.flip = flip;
    const GridMesh mesh = dice_with(cage, UniformDicingView(0.1f), settings);
    for (size_t i = 0; i < mesh.P.size(); ++i) {
      EXPECT_NEAR(mesh.P[i].z, flip ? -0.25f : 0.25f, 1e-6f);
      EXPECT_NEAR(mesh.N[i].z, flip ? -1 : 1, 1e-6f);
    }
  }
}

TEST(Dicer, LargePatchesBecomeTiles) {
  ControlCage cage = plane_cage(1, 1);
  cage.scheme = SurfaceScheme::polygons;
  const GridMesh mesh = dice_with(cage, UniformDicingView(1 / 1024.0f));
  ASSERT_EQ(mesh.grids.size(), 16u);
  EXPECT_EQ(mesh.P.size(), 1025u * 1025u);
  std::map<uint64_t, int> numbers;
  for (uint32_t g = 0; g < 16; ++g) {
    EXPECT_EQ(mesh.grids[g].columns, 257);
    EXPECT_EQ(mesh.grids[g].rows, 257);
    ++numbers[mesh.patch_number(g)];
    const SurfacePoint s = mesh.at(g, 0.5f, 0.5f, 0);
    EXPECT_NEAR(s.P.x, (float(mesh.parts[g].u_tile) + 0.5f) / 4, 1e-6f);
    EXPECT_NEAR(s.P.y, (float(mesh.parts[g].v_tile) + 0.5f) / 4, 1e-6f);
    EXPECT_NEAR(s.u, s.P.x, 1e-6f);
  }
  EXPECT_EQ(numbers.size(), 16u);
}

// Patches keep their numbers while the camera moves.
TEST(Dicer, PatchNumbersDependOnTheCageAlone) {
  const GridMesh a = dice_with(figure_cage(), UniformDicingView(0.02f)),
                 b = dice_with(figure_cage(), PatchyView(0.1f, 0.9f));
  ASSERT_EQ(a.grids.size(), b.grids.size());
  for (uint32_t g = 0; g < a.grids.size(); ++g) EXPECT_EQ(a.patch_number(g), b.patch_number(g));
}

TEST(Dicer, StaysWithinItsVertices) {
  DiceSettings settings;
  settings.max_vertices = 5000;
  ControlCage cage = figure_cage();
  DiceReport report;
  const GridMesh mesh = dice(*make_patch_surface(cage), PatchyView(0.005f, 0.7f), settings, &report);
  EXPECT_LE(mesh.P.size(), 5000u);
  EXPECT_GT(report.coarsened, 0);
  EXPECT_EQ(open_edges(mesh, mesh.P), 0u);
}

// Tangents by the texture coordinates, at any place of a patch and also where micropolygons at the border have no area.
TEST(GridMesh, SurfaceIsDefinedEverywhere) {
  ControlCage cage = figure_cage();
  for (const V3f& p : cage.P) cage.uv.push_back(V2f(p.x + 0.3f * p.y, p.z - 0.2f * p.y));
  const GridMesh mesh = dice_with(cage, PatchyView(0.03f, 0.7f));
  KeyedRng rng(3);
  for (uint32_t g = 0; g < mesh.grids.size(); ++g)
    for (int i = 0; i < 200; ++i) {
      const float u = i < 20 ? float(i % 5) / 4 : rng.next(), v = i < 20 ? float(i / 5) / 3 : rng.next();
      const SurfacePoint s = mesh.at(g, u, v, 0);
      EXPECT_NEAR(length(s.Ng), 1, 1e-4f);
      EXPECT_NEAR(length(s.Ns), 1, 1e-4f);
      EXPECT_GE(dot(s.Ng, s.Ns), 0);
      EXPECT_TRUE(is_finite(s.P) && is_finite(s.dPdu) && is_finite(s.dPdv) && is_finite(s.dNdu) && is_finite(s.dNdv));
    }
}

// The same for any number of threads.
TEST(Dicer, IsTheSameForAnyNumberOfThreads) {
  const Waves waves(0.1f, 5);
  DiceSettings settings;
  settings.displacement.displacer = &waves;
  const int threads = thread_count();
  set_thread_count(1);
  const GridMesh a = dice_with(figure_cage(), PatchyView(0.01f, 0.7f), settings);
  set_thread_count(4);
  const GridMesh b = dice_with(figure_cage(), PatchyView(0.01f, 0.7f), settings);
  set_thread_count(threads);
  EXPECT_EQ(a.P, b.P);
  EXPECT_EQ(a.N, b.N);
}

}  // namespace
}  // namespace dapple::geom
