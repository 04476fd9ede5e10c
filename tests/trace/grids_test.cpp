// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstdlib>

#include "dapple/geom/dicer.h"
#include "dapple/numeric/warp.h"
#include "dapple/trace/traced_scene.h"
#include "tests/support/cages.h"

namespace dapple::trace {
namespace {

using geom::GridMesh;
using test::PatchyView;
using test::Waves;

GridsPtr diced(geom::ControlCage cage, float pixel, bool displaced) {
  const Waves waves(0.08f, 5);
  geom::DiceSettings settings;
  if (displaced) settings.displacement.displacer = &waves;
  cage.clean();
  geom::DiceReport report;
  return std::make_shared<const GridMesh>(
      geom::dice(*geom::make_patch_surface(std::move(cage)), PatchyView(pixel, 0.7f), settings, &report));
}

geom::ControlCage moving_figure() {
  geom::ControlCage cage = test::figure_cage();
  for (const V3f& p : cage.P) cage.P_end.push_back(p + V3f(0.3f * p.z, 0.1f, 0));
  return cage;
}

struct Traced {
  RayBatch rays;
  HitBatch hits;
};

// u, v of a hit span the patch: the surface there is where the ray met it, at any time of the shutter.
TEST(Grids, SurfaceLiesWhereTheRayMetIt) {
  for (const bool moves : {false, true}) {
    TracedScene scene;
    const GridsPtr grids = diced(moves ? moving_figure() : test::figure_cage(), 0.02f, true);
    scene.add(grids, CutOut::none);
    const uint32_t object = scene.add_object();
    scene.add(grids, CutOut::none, object);
    const Transform place =
        Transform::translate({8, 0, 0}) * Transform::rotate(30, {1, 1, 0}) * Transform::scale({1, -1.5, 1});
    scene.add_instance(object, AnimatedTransform(place, place));
    scene.commit();
    const auto t = std::make_unique<Traced>();
    KeyedRng rng(1);
    int hits = 0, instanced = 0, from_outside = 0;
    for (int batch = 0; batch < 40; ++batch) {
      for (int i = 0; i < RayBatch::capacity; ++i) {
        const V3f to(11 * rng.next() - 1, 2 * rng.next() - 1, 7 * rng.next());
        t->rays.set(i, to + square_to_sphere(V2f(rng.next(), rng.next())) * 30.0f, V3f(0, 0, 0), infinity, rng.next(),
                    0);
        const V3f d = normalize(to - t->rays.origin(i));
        t->rays.dx[i] = d.x, t->rays.dy[i] = d.y, t->rays.dz[i] = d.z;
      }
      scene.intersect(t->rays, RayBatch::capacity, &t->hits);
      for (int i = 0; i < RayBatch::capacity; ++i) {
        if (t->hits.geometry[i] == no_id) continue;
        ++hits;
        instanced += t->hits.instance[i] != no_id;
        const geom::SurfacePoint s = scene.surface(t->hits, i, t->rays.time[i]),
                                 cheap = scene.surface_without_tangents(t->rays, t->hits, i);
        const V3f d = t->rays.direction(i), p = t->rays.origin(i) + d * t->hits.t[i];
        ASSERT_LT(length(s.P - p), 2e-4f);
        from_outside += dot(s.Ng, d) < 1e-3f;
        EXPECT_EQ(cheap.P, s.P);
        EXPECT_EQ(cheap.Ng, s.Ng);
      }
    }
    EXPECT_GT(hits, 2000);
    EXPECT_GT(from_outside, 0.999 * hits);  // displaced creases fold
    EXPECT_GT(instanced, 500);
  }
}

// The opacity test is asked with the patch's own u, v.
class CutByU final : public OpacityTest {
 public:
  void opacity(uint32_t, int n, const uint32_t*, const float* u, const float*, const float*,
               float* alpha) const override {
    for (int i = 0; i < n; ++i) alpha[i] = u[i] < 0.25f ? 0.0f : 1.0f;
  }
};

TEST(Grids, AreCutOutByOpacity) {
  TracedScene scene;
  const CutByU cut;
  scene.set_opacity_test(&cut);
  geom::ControlCage cage = test::plane_cage(1, 1);
  cage.scheme = geom::SurfaceScheme::polygons;
  scene.add(diced(cage, 0.02f, false), CutOut::gray);
  scene.commit();
  const auto t = std::make_unique<Traced>();
  for (int i = 0; i < RayBatch::capacity; ++i)
    t->rays.set(i, V3f((float(i) + 0.5f) / 256, 0.4f, 1), V3f(0, 0, -1), infinity, 0, 0);
  scene.intersect(t->rays, RayBatch::capacity, &t->hits);
  for (int i = 0; i < RayBatch::capacity; ++i) EXPECT_EQ(t->hits.geometry[i] != no_id, i >= 64);
}

// Rays from inside a closed surface that miss it.
size_t escaping(const GridsPtr& grids, const std::vector<V3f>& inside, size_t ray_count) {
  TracedScene scene;
  scene.add(grids, CutOut::none);
  scene.commit();
  const auto t = std::make_unique<Traced>();
  KeyedRng rng(7);
  size_t escaped = 0;
  for (size_t n = 0; n < ray_count; n += RayBatch::capacity) {
    for (int i = 0; i < RayBatch::capacity; ++i) {
      const V3f& o = inside[size_t(i) % inside.size()];
      t->rays.set(i, o + V3f(rng.next(), rng.next(), rng.next()) * 0.1f, square_to_sphere(V2f(rng.next(), rng.next())),
                  infinity, rng.next(), 0);
    }
    scene.intersect(t->rays, RayBatch::capacity, &t->hits);
    for (int i = 0; i < RayBatch::capacity; ++i) escaped += t->hits.geometry[i] == no_id;
  }
  return escaped;
}

const std::vector<V3f> in_figure = {V3f(0.9f, 0.5f, 3), V3f(0.5f, 0.5f, 4.4f), V3f(0.5f, 0.5f, 2.5f)};

// DAPPLE_TEST_RAYS=10000000 for a long look: no ray has escaped.
size_t count_from_environment(size_t fallback) {
  const char* text = std::getenv("DAPPLE_TEST_RAYS");
  return text ? size_t(std::atoll(text)) : fallback;
}

TEST(Grids, NoRayEscapesFromADisplacedCreasedFigure) {
  EXPECT_EQ(escaping(diced(test::figure_cage(), 0.01f, true), in_figure, count_from_environment(1'000'000)), 0u);
}
TEST(Grids, NoRayEscapesFromAMovingFigure) {
  EXPECT_EQ(escaping(diced(moving_figure(), 0.02f, true), {V3f(1.2f, 0.5f, 3)}, count_from_environment(300'000)), 0u);
}
TEST(Grids, NoRayEscapesFromASphere) {
  EXPECT_EQ(escaping(diced(test::sphere_cage(16, 9), 0.002f, false), {V3f(0, 0, 0), V3f(0.3f, 0.2f, 0.1f)},
                     count_from_environment(1'000'000)),
            0u);
}

// Aimed past the borders of patches by some units in the last place, where cracks would be. (Not exactly at them: rays
// through vertices may pass Embree's robust test, of triangles as of grids.)
TEST(Grids, NoRayPassesAtTheBordersOfPatches) {
  const GridsPtr grids = diced(test::figure_cage(), 0.01f, true);
  TracedScene scene;
  scene.add(grids, CutOut::none);
  scene.commit();
  const auto t = std::make_unique<Traced>();
  KeyedRng rng(5);
  size_t escaped = 0, n = 0;
  for (uint32_t g = 0; g < grids->grids.size(); ++g)
    for (int batch = 0; batch < 8; ++batch) {
      for (int i = 0; i < RayBatch::capacity; ++i) {
        const float f = rng.next();
        const int side = i % 4;
        const V3f P = grids->at(g, side == 1 ? 1 : side == 3 ? 0 : f, side == 2 ? 1 : side == 0 ? 0 : f, 0, false).P;
        const V3f o = in_figure[size_t(i / 4) % in_figure.size()];
        const V3f past = square_to_sphere(V2f(rng.next(), rng.next())) * 1e-5f;
        t->rays.set(i, o, normalize(P + past - o), infinity, 0, 0);
      }
      scene.intersect(t->rays, RayBatch::capacity, &t->hits);
      for (int i = 0; i < RayBatch::capacity; ++i) escaped += t->hits.geometry[i] == no_id;
      n += RayBatch::capacity;
    }
  EXPECT_GT(n, 100'000u);
  EXPECT_EQ(escaped, 0u);
}

}  // namespace
}  // namespace dapple::trace
