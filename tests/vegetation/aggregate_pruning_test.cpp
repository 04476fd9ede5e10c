// SPDX-License-Identifier: Apache-2.0
#include "dapple/vegetation/aggregate_pruning.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <random>
#include <set>

#include "dapple/geom/mesh_components.h"
#include "dapple/trace/traced_scene.h"
#include "dapple/vegetation/component_shape.h"

namespace dapple::vegetation {
namespace {

using geom::Mesh;
using geom::MeshComponents;
using geom::UniformDicingView;

using Random = std::mt19937;

float uniform(Random& rng, float low, float high) {
  return std::uniform_real_distribution<float>(low, high)(rng);
}

V3f any_direction(Random& rng) {
  const float z = uniform(rng, -1, 1), phi = uniform(rng, 0, 6.2831853f), r = std::sqrt(1 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

// Two triangles; texture coordinates tell the leaf's number.
void add_leaf(Mesh* mesh, const V3f& at, const V3f& u, const V3f& v) {
  const auto first = uint32_t(mesh->P.size());
  const auto number = float(first / 4);
  const V3f n = normalize(cross(u, v));
  for (const V2f& c : {V2f(-1, -1), V2f(1, -1), V2f(1, 1), V2f(-1, 1)}) {
    mesh->P.push_back(at + u * (c.x / 2) + v * (c.y / 2));
    mesh->N.push_back(n);
    mesh->uv.emplace_back(number, c.x);
  }
  for (const uint32_t i : {0u, 1u, 2u, 0u, 2u, 3u}) mesh->indices.push_back(first + i);
  for (int i = 0; i < 2; ++i) mesh->source_face.push_back(first / 4);
}

Mesh random_leaves(int count, float size, const V3f& extent, uint32_t seed = 1) {
  Random rng(seed);
  Mesh mesh;
  for (int i = 0; i < count; ++i) {
    const V3f at(uniform(rng, 0, extent.x), uniform(rng, 0, extent.y), uniform(rng, 0, extent.z));
    const V3f n = any_direction(rng), u = normalize(cross(n, any_direction(rng)));
    add_leaf(&mesh, at, u * size, cross(n, u) * size * uniform(rng, 0.5f, 1.0f));
  }
  return mesh;
}

void add_box(Mesh* mesh, const V3f& low, const V3f& high) {
  const auto first = uint32_t(mesh->P.size());
  for (int i = 0; i < 8; ++i)
    mesh->P.emplace_back(i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z);
  for (const uint32_t i : {0u, 2u, 3u, 0u, 3u, 1u, 4u, 5u, 7u, 4u, 7u, 6u, 0u, 1u, 5u, 0u, 5u, 4u,
                           2u, 6u, 7u, 2u, 7u, 3u, 0u, 4u, 6u, 0u, 6u, 2u, 1u, 3u, 7u, 1u, 7u, 5u})
    mesh->indices.push_back(first + i);
}

double area_of(const Mesh& mesh) {
  double area = 0;
  for (size_t i = 0; i < mesh.indices.size(); i += 3) {
    const V3d a(mesh.P[mesh.indices[i]]), b(mesh.P[mesh.indices[i + 1]]), c(mesh.P[mesh.indices[i + 2]]);
    area += (b - a).cross(c - a).length() / 2;
  }
  return area;
}

// Share of rays along `direction` that pass the middle of the plot [0, side]^2.
double gap_fraction(const Mesh& mesh, const V3f& direction, float side, float margin) {
  trace::TracedScene scene;
  scene.add(std::make_shared<const Mesh>(mesh), trace::CutOut::none);
  scene.commit();
  constexpr int n = 400;
  using trace::RayBatch;
  const auto rays = std::make_unique<RayBatch>();
  std::vector<RGB> passed(RayBatch::capacity);
  Random rng(7);
  double sum = 0;
  for (int done = 0; done < n * n; done += RayBatch::capacity) {
    for (int i = 0; i < RayBatch::capacity; ++i) {
      const int cell = (done + i) % (n * n);
      const V3f p(margin + (side - 2 * margin) * (float(cell % n) + uniform(rng, 0, 1)) / n,
                  margin + (side - 2 * margin) * (float(cell / n) + uniform(rng, 0, 1)) / n, 0);
      rays->set(i, p - direction * 100.0f, direction, infinity, 0, 0);
    }
    scene.transmitted(*rays, RayBatch::capacity, passed.data());
    const int used = std::min(int(RayBatch::capacity), n * n - done);
    for (int i = 0; i < used; ++i) sum += double(passed[size_t(i)].g);
  }
  return sum / (n * n);
}

// Areas add up whatever is merged, so only rounding to floats is left.
TEST(AggregatePruning, KeepsArea) {
  const Mesh full = random_leaves(20000, 0.1f, V3f(10, 10, 10));
  for (const float pixel : {0.2f, 0.4f, 1.0f}) {
    Mesh mesh = full;
    PruningCounts counts;
    ASSERT_TRUE(prune(&mesh, UniformDicingView(pixel), 1, &counts));
    EXPECT_NEAR(area_of(mesh), area_of(full), 1e-5 * area_of(full));
    EXPECT_EQ(counts.components, 20000u);
    EXPECT_EQ(MeshComponents(mesh).count(), counts.kept);
    EXPECT_EQ(mesh.face_count(), counts.faces_kept);
    EXPECT_EQ(mesh.bytes(), counts.bytes_kept);
    EXPECT_LT(counts.kept, pixel < 0.3f ? 14000u : 4000u);
  }
}

// A slab of random leaves has gaps of exp(-G L) however large they are. Where one of each cluster is left they lie more
// evenly than at random and cover a little more. The standard deviation over draws is sqrt(gap (1 - gap) leaf / plot):
// .004 for the larger ones, less in the mean of six directions.
TEST(AggregatePruning, KeepsTransmittance) {
  const Mesh full = random_leaves(240000, 0.1f, V3f(40, 40, 3));
  const V3f directions[] = {V3f(0, 0, -1), V3f(1, 0, -1), V3f(0, 1, -1), V3f(1, 1, -1), V3f(-1, 1, -1), V3f(2, 1, -2)};
  const auto mean_gap = [&](const Mesh& mesh) {
    double sum = 0;
    for (const V3f& d : directions) sum += gap_fraction(mesh, normalize(d), 40, 4) / 6;
    return sum;
  };
  const double gap = mean_gap(full);
  for (const float pixel : {0.2f, 0.3f}) {
    Mesh mesh = full;
    PruningCounts counts;
    ASSERT_TRUE(prune(&mesh, UniformDicingView(pixel), 1, &counts));
    EXPECT_LT(double(counts.kept), (pixel < 0.25f ? 0.7 : 0.4) * double(counts.components));
    EXPECT_NEAR(mean_gap(mesh), gap, 0.01) << pixel;
  }
}

// Of two kinds of leaves, one of four times the area, four of five that are kept should be of that. 900 are, of which a
// binomial share deviates by .013.
TEST(AggregatePruning, DrawsByArea) {
  Random rng(9);
  Mesh mesh;
  for (int i = 0; i < 20000; ++i) {
    const V3f at(uniform(rng, 0, 10), uniform(rng, 0, 10), uniform(rng, 0, 10));
    const V3f n = any_direction(rng), u = normalize(cross(n, any_direction(rng)));
    const float size = i % 2 ? 0.1f : 0.05f;
    add_leaf(&mesh, at, u * size, cross(n, u) * size);
  }
  PruningCounts counts;
  ASSERT_TRUE(prune(&mesh, UniformDicingView(0.6f), 1, &counts));
  ASSERT_LT(counts.kept, 1500u);
  double large = 0;
  for (const uint32_t leaf : mesh.source_face) large += leaf % 2;
  EXPECT_NEAR(large / double(mesh.source_face.size()), 0.8, 0.05);
}

TEST(AggregatePruning, CoarserLevelsKeepPartOfFiner) {
  const Mesh full = random_leaves(5000, 0.1f, V3f(5, 5, 5));
  std::set<uint32_t> finer;
  for (const float pixel : {0.2f, 0.4f, 0.8f}) {
    Mesh mesh = full;
    PruningCounts counts;
    ASSERT_TRUE(prune(&mesh, UniformDicingView(pixel), 1, &counts));
    const std::set<uint32_t> kept(mesh.source_face.begin(), mesh.source_face.end());
    EXPECT_TRUE(finer.empty() || std::includes(finer.begin(), finer.end(), kept.begin(), kept.end()));
    finer = kept;
  }
}

TEST(AggregatePruning, LeavesWhatIsNear) {
  class HalfNear final : public geom::DicingView {
   public:
    void pixel_widths(std::span<const V3f> P, float* widths) const override {
      for (size_t i = 0; i < P.size(); ++i) widths[i] = P[i].x < 1.7f ? 0.01f : 0.5f;
    }
  };
  const Mesh full = random_leaves(5000, 0.1f, V3f(5, 5, 5));
  Mesh mesh = full;
  PruningCounts counts;
  EXPECT_FALSE(prune(&mesh, UniformDicingView(0.05f), 1, &counts));
  EXPECT_EQ(mesh.P, full.P);
  EXPECT_EQ(mesh.indices, full.indices);
  ASSERT_TRUE(prune(&mesh, HalfNear(), 1, &counts));
  std::set<std::array<float, 3>> kept;
  for (const V3f& p : mesh.P) kept.insert({p.x, p.y, p.z});
  size_t near = 0;
  for (size_t i = 0; i < full.P.size(); i += 4) {
    const V3f middle = (full.P[i] + full.P[i + 2]) * 0.5f;
    if (middle.x > 1.69f) continue;
    ++near;
    for (size_t k = i; k < i + 4; ++k) EXPECT_EQ(kept.count({full.P[k].x, full.P[k].y, full.P[k].z}), 1u);
  }
  EXPECT_GT(near, 1500u);
  EXPECT_LT(mesh.P.size() / 4, near + 500);
}

TEST(AggregatePruning, CarriesWhatVerticesAndFacesHave) {
  const Mesh full = random_leaves(3000, 0.1f, V3f(4, 4, 4));
  Mesh mesh = full;
  mesh.flip = true;
  for (const V3f& p : full.P) mesh.P_end.push_back(p + V3f(1, 0, 0));
  PruningCounts counts;
  ASSERT_TRUE(prune(&mesh, UniformDicingView(0.4f), 1, &counts));
  EXPECT_TRUE(mesh.flip);
  ASSERT_EQ(mesh.P_end.size(), mesh.P.size());
  ASSERT_EQ(mesh.N.size(), mesh.P.size());
  ASSERT_EQ(mesh.uv.size(), mesh.P.size());
  ASSERT_EQ(mesh.source_face.size(), mesh.face_count());
  for (size_t f = 0; f < mesh.face_count(); ++f)
    for (int i = 0; i < 3; ++i) {
      const uint32_t v = mesh.indices[3 * f + size_t(i)], leaf = mesh.source_face[f], of_leaf = v % 4;
      ASSERT_EQ(mesh.uv[v], full.uv[4 * leaf + of_leaf]);
      ASSERT_EQ(mesh.N[v], full.N[4 * leaf]);
      EXPECT_LT(length(mesh.P_end[v] - mesh.P[v] - V3f(1, 0, 0)), 1e-5f);
      const V3f *p = &mesh.P[v - of_leaf], *q = &full.P[4 * leaf];  // it has grown evenly
      EXPECT_LT(length(normalize(p[2] - p[0]) - normalize(q[2] - q[0])), 1e-3f);
    }
}

TEST(AggregatePruning, LeavesSolids) {
  Mesh wall, pebbles, trunk = random_leaves(500, 0.05f, V3f(5, 5, 5));
  Random rng(5);
  for (int row = 0; row < 40; ++row)
    for (int i = 0; i < 40; ++i) {
      const V3f low(0.22f * float(i) + 0.11f * float(row % 2), 0, 0.08f * float(row));
      add_box(&wall, low, low + V3f(0.21f, 0.1f, 0.07f));
    }
  for (int i = 0; i < 1600; ++i) {
    const V3f low(uniform(rng, 0, 20), uniform(rng, 0, 20), 0);
    add_box(&pebbles, low, low + V3f(0.1f, 0.08f, 0.05f));
  }
  trunk.N.clear(), trunk.uv.clear(), trunk.source_face.clear();
  const auto first = uint32_t(trunk.P.size());
  for (int i = 0; i <= 50; ++i)
    trunk.P.emplace_back(2.5f, 2.5f, 0.1f * float(i)), trunk.P.emplace_back(2.55f, 2.5f, 0.1f * float(i));
  for (uint32_t i = 0; i < 50; ++i)
    for (const uint32_t k : {0u, 1u, 2u, 1u, 3u, 2u}) trunk.indices.push_back(first + 2 * i + k);
  const std::vector<V3f> of_trunk(trunk.P.begin() + first, trunk.P.end());

  PruningCounts counts;
  EXPECT_FALSE(prune(&wall, UniformDicingView(1), 1, &counts));
  const double area = area_of(pebbles);
  ASSERT_TRUE(prune(&pebbles, UniformDicingView(1), 1, &counts));
  EXPECT_LT(MeshComponents(pebbles).count(), 800u);
  EXPECT_NEAR(area_of(pebbles), area, 1e-5 * area);  // of convex things a quarter of it is seen on average (Cauchy)
  ASSERT_TRUE(prune(&trunk, UniformDicingView(1), 1, &counts));
  ASSERT_LT(trunk.P.size(), 4 * 200 + of_trunk.size());
  EXPECT_TRUE(std::equal(of_trunk.begin(), of_trunk.end(), trunk.P.end() - ptrdiff_t(of_trunk.size())));
}

TEST(AggregatePruning, WidensWhatIsLong) {
  Random rng(11);
  Mesh needles;
  for (int i = 0; i < 4000; ++i) {
    const V3f n = any_direction(rng), u = normalize(cross(n, any_direction(rng)));
    add_leaf(&needles, V3f(uniform(rng, 0, 5), uniform(rng, 0, 5), uniform(rng, 0, 5)), u * 0.2f, cross(n, u) * 0.002f);
  }
  const double area = area_of(needles);
  PruningCounts counts;
  ASSERT_TRUE(prune(&needles, UniformDicingView(0.05f), 1, &counts));
  EXPECT_LT(counts.kept, 1500u);
  EXPECT_NEAR(area_of(needles), area, 1e-3 * area);
  for (size_t i = 0; i < needles.P.size(); i += 4) {
    EXPECT_NEAR(length(needles.P[i + 1] - needles.P[i]), 0.2f, 1e-4f);
    EXPECT_LE(length(needles.P[i + 2] - needles.P[i + 1]), 0.0501f);
  }
}

// Of a box of sides u, v, w at a corner.
void add_box(Mesh* mesh, const V3f& at, const V3f& u, const V3f& v, const V3f& w) {
  const size_t first = mesh->P.size();
  add_box(mesh, V3f(0, 0, 0), V3f(1, 1, 1));
  for (size_t i = first; i < mesh->P.size(); ++i)
    mesh->P[i] = at + u * mesh->P[i].x + v * mesh->P[i].y + w * mesh->P[i].z;
}

void expect_area_stays(const Mesh& full, float pixel, size_t most_kept, float largest) {
  Mesh mesh = full;
  PruningCounts counts;
  ASSERT_TRUE(prune(&mesh, UniformDicingView(pixel), 1, &counts));
  EXPECT_LT(counts.kept, most_kept);
  EXPECT_NEAR(area_of(mesh), area_of(full), 0.01 * area_of(full)) << pixel;
  const MeshComponents components(mesh);
  for (uint32_t c = 0; c < components.count(); ++c)
    EXPECT_LE(ComponentShape(mesh, mesh.P, components.faces(c)).radius(), 0.5f * largest);
}

// Their ends grow with the square of what their sides do. Once they are as wide as long, they grow evenly.
TEST(AggregatePruning, KeepsAreaOfClosedNeedles) {
  for (const float long_side : {0.006f, 0.016f}) {
    Random rng(13);
    Mesh needles;
    for (int i = 0; i < 10000; ++i) {
      const V3f at(uniform(rng, 0, 1), uniform(rng, 0, 1), uniform(rng, 0, 1));
      const V3f n = any_direction(rng), u = normalize(cross(n, any_direction(rng)));
      add_box(&needles, at, u * long_side, cross(n, u) * 0.001f, n * 0.001f);
    }
    for (const float pixel : {0.01f, 0.03f, 0.1f}) expect_area_stays(needles, pixel, 6000, 0.04f + pixel);
  }
}

// Corners of half leaves lie on the bent side and at the ends of the straight one.
TEST(AggregatePruning, KeepsAreaOfHalfLeaves) {
  for (const double radius : {0.0, 0.625, 0.501}) {  // of the bent side; 0: a parabola
    Random rng(17);
    Mesh leaves;
    for (int i = 0; i < 5000; ++i) {
      const V3f at(uniform(rng, 0, 5), uniform(rng, 0, 5), uniform(rng, 0, 5));
      const V3f n = any_direction(rng), u = normalize(cross(n, any_direction(rng))), v = cross(n, u);
      const auto first = uint32_t(leaves.P.size());
      for (int k = 0; k <= 8; ++k) {
        const double t = k / 8.0 - 0.5;
        const double y =
            radius > 0 ? std::sqrt(radius * radius - t * t) - std::sqrt(radius * radius - 0.25) : 0.25 - t * t;
        leaves.P.push_back(at + u * float(0.1 * t) + v * float(0.1 * y));
      }
      for (uint32_t k = 1; k < 8; ++k)
        for (const uint32_t corner : {0u, k, k + 1}) leaves.indices.push_back(first + corner);
    }
    for (const float pixel : {0.2f, 0.4f}) expect_area_stays(leaves, pixel, 4000, 0.1f + 1.1f * pixel);
  }
}

TEST(AggregatePruning, LeavesSolidsHoweverTurned) {
  for (const float angle : {0.0f, 0.5f, 0.7853982f}) {
    const V3f along(std::cos(angle), std::sin(angle), 0), off(-std::sin(angle), std::cos(angle), 0), up(0, 0, 1);
    Mesh wall, cobbles;
    for (int row = 0; row < 100; ++row)
      for (int i = 0; i < 100; ++i) {
        const V3f brick = along * (0.22f * float(i) + 0.11f * float(row % 2)) + up * (0.08f * float(row));
        add_box(&wall, brick, along * 0.21f, off * 0.1f, up * 0.07f);
        add_box(&cobbles, (along * float(i) + up * float(row)) * 0.1f, along * 0.095f, up * 0.095f, off * 0.05f);
      }
    PruningCounts counts;
    for (const float pixel : {1.0f, 2.0f, 4.0f}) {
      EXPECT_FALSE(prune(&wall, UniformDicingView(pixel), 1, &counts)) << angle;
      EXPECT_FALSE(prune(&cobbles, UniformDicingView(pixel), 1, &counts)) << angle;
    }
  }
}

TEST(AggregatePruning, LooksAtBothEndsOfVertexMotion) {
  class NearBeyond final : public geom::DicingView {
   public:
    void pixel_widths(std::span<const V3f> P, float* widths) const override {
      for (size_t i = 0; i < P.size(); ++i) widths[i] = P[i].x > 50 ? 0.01f : 0.5f;
    }
  };
  Mesh still = random_leaves(2000, 0.1f, V3f(3, 3, 3)), moves = still, grows = still;
  for (size_t i = 0; i < still.P.size(); ++i) {
    moves.P_end.push_back(still.P[i] + V3f(100, 0, 0));
    grows.P_end.push_back(still.P[i - i % 4] + (still.P[i] - still.P[i - i % 4]) * 10.0f);
  }
  PruningCounts counts;
  EXPECT_TRUE(prune(&still, NearBeyond(), 1, &counts));
  EXPECT_FALSE(prune(&moves, NearBeyond(), 1, &counts));
  EXPECT_FALSE(prune(&grows, NearBeyond(), 1, &counts));
}

// Of a bent tube, whose normals must stay those of its surface.
TEST(ComponentShape, WidensAlongAParabola) {
  Mesh tube;
  constexpr int rings = 40, sides = 12;
  for (int i = 0; i <= rings; ++i)
    for (int k = 0; k < sides; ++k) {
      const float t = float(i) / rings - 0.5f, a = 6.2831853f * float(k) / sides;
      const V3f tangent = normalize(V3f(1, 0, 0.8f * t)), up(-tangent.z, 0, tangent.x),
                n = V3f(0, 1, 0) * std::cos(a) + up * std::sin(a);
      tube.P.push_back(V3f(t, 0, 0.4f * t * t) + n * 0.01f);
      tube.N.push_back(n);
    }
  for (uint32_t i = 0; i < rings; ++i)
    for (uint32_t k = 0; k < sides; ++k) {
      const uint32_t a = i * sides + k, b = i * sides + (k + 1) % sides;
      for (const uint32_t v : {a, a + sides, b, b, a + sides, b + sides}) tube.indices.push_back(v);
    }
  std::vector<uint32_t> all(tube.face_count());
  for (uint32_t i = 0; i < all.size(); ++i) all[i] = i;
  const ComponentShape shape(tube, tube.P, all);
  EXPECT_NEAR(shape.width(), 0.02 * std::sqrt(1.5), 0.001);
  EXPECT_NEAR(shape.length(), 1, 0.03);
  for (size_t i = 0; i < tube.P.size(); ++i) {
    const V3f p(shape.widened(tube.P[i], 4));
    const V3f middle = tube.P[i] - tube.N[i] * 0.01f;
    EXPECT_NEAR(length(p - middle), 0.04f, 0.003f);
    const V3f n = shape.widened_normal(tube.P[i], tube.N[i], 4);
    EXPECT_GT(dot(n, tube.N[i]), 0.98f);
  }
}

}  // namespace
}  // namespace dapple::vegetation
