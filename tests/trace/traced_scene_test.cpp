// SPDX-License-Identifier: Apache-2.0
#include "dapple/trace/traced_scene.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "dapple/base/error.h"
#include "dapple/base/hash.h"
#include "dapple/base/parallel.h"
#include "dapple/base/timer.h"
#include "dapple/numeric/warp.h"

namespace dapple::trace {
namespace {

// Triangles and quads in all directions, outside and inside out.
MeshPtr random_mesh(int corners, bool flip, uint64_t key) {
  auto mesh = std::make_shared<geom::Mesh>();
  mesh->corners = corners;
  mesh->flip = flip;
  KeyedRng rng(key);
  for (int f = 0; f < 40; ++f) {
    const V3f p(4 * rng.next() - 2, 4 * rng.next() - 2, 4 * rng.next() - 2);
    const V3f e1 = square_to_sphere(V2f(rng.next(), rng.next())), e2 = square_to_sphere(V2f(rng.next(), rng.next()));
    const V3f ring[4] = {p, p + e1, corners == 3 ? p + e2 : p + e1 + e2, p + e2};
    for (int i = 0; i < corners; ++i) {
      mesh->indices.push_back(uint32_t(mesh->P.size()));
      mesh->P.push_back(ring[i]);
    }
  }
  return mesh;
}

void random_rays(uint64_t key, int n, RayBatch* rays) {
  KeyedRng rng(key);
  for (int i = 0; i < n; ++i) {
    const V3f o = square_to_sphere(V2f(rng.next(), rng.next())) * 5.0f;
    const V3f to(3 * rng.next() - 1.5f, 3 * rng.next() - 1.5f, 3 * rng.next() - 1.5f);
    rays->set(i, o, normalize(to - o), infinity, 0, uint32_t(i));
  }
}

struct Traced {
  RayBatch rays;
  HitBatch hits;
};

class Meshes : public testing::TestWithParam<std::tuple<int, bool>> {};

// The cheap surface must be the full one but for its tangents, and both must lie on the ray.
TEST_P(Meshes, CheapSurfaceIsTheSameSurface) {
  const auto [corners, flip] = GetParam();
  TracedScene scene;
  scene.add(random_mesh(corners, flip, 1), CutOut::none);
  scene.commit();
  const auto t = std::make_unique<Traced>();
  random_rays(2, RayBatch::capacity, &t->rays);
  scene.intersect(t->rays, RayBatch::capacity, &t->hits);
  int hits = 0;
  for (int i = 0; i < RayBatch::capacity; ++i) {
    if (t->hits.geometry[i] == no_id) continue;
    ++hits;
    const geom::SurfacePoint a = scene.surface(t->hits, i, 0), b = scene.surface_without_tangents(t->rays, t->hits, i);
    EXPECT_LT(length(a.P - b.P), 1e-4f);
    EXPECT_LT(length(a.P - t->rays.origin(i) - t->rays.direction(i) * t->hits.t[i]), 1e-4f);
    EXPECT_GT(dot(a.Ng, b.Ng), 0.9999f);
  }
  EXPECT_GT(hits, 50);
}

INSTANTIATE_TEST_SUITE_P(All, Meshes, testing::Combine(testing::Values(3, 4), testing::Bool()));

// Packets of 8 to 16 rays, runs too short and too long for one, and rays among them that are no numbers.
TEST(TracedScene, JoinedRaysMeetWhatSingleOnesDo) {
  TracedScene scene;
  scene.add(random_mesh(3, false, 1), CutOut::none);
  const uint32_t object = scene.add_object();
  scene.add(random_mesh(4, true, 2), CutOut::none, object);
  const Transform place = Transform::translate(V3d(0.5, 0, 0));
  scene.add_instance(object, AnimatedTransform(place, place));
  scene.commit();
  const auto alone = std::make_unique<Traced>(), joined = std::make_unique<Traced>();
  random_rays(3, RayBatch::capacity, &alone->rays);
  for (const int bad : {20, 64, 200}) alone->rays.dx[bad] = std::numeric_limits<float>::quiet_NaN();
  for (int i = 0; i < RayBatch::capacity; ++i)
    if (i % 3 == 0) alone->rays.t_max[i] = 4;
  joined->rays = alone->rays;
  int packets = 0;
  for (int i = 0, run = 1; i < RayBatch::capacity; i += run, run = run % 35 + 3, ++packets)
    for (int j = 1; j < run && i + j < RayBatch::capacity; ++j) joined->rays.joined[i + j] = true;
  ASSERT_GT(packets, 10);
  scene.intersect(alone->rays, RayBatch::capacity, &alone->hits);
  scene.intersect(joined->rays, RayBatch::capacity, &joined->hits);
  RGB passed[RayBatch::capacity], passed_joined[RayBatch::capacity];
  scene.transmitted(alone->rays, RayBatch::capacity, passed);
  scene.transmitted(joined->rays, RayBatch::capacity, passed_joined);
  int hits = 0;
  for (int i = 0; i < RayBatch::capacity; ++i) {
    const HitBatch &a = alone->hits, &b = joined->hits;
    ASSERT_EQ(a.geometry[i], b.geometry[i]) << i;
    EXPECT_EQ(passed[i], passed_joined[i]) << i;
    if (a.geometry[i] == no_id) {
      EXPECT_EQ(a.t[i], b.t[i]) << i;
      continue;
    }
    ++hits;
    EXPECT_NEAR(a.t[i], b.t[i], 1e-5f * a.t[i]) << i;
    EXPECT_EQ(a.instance[i], b.instance[i]) << i;
    EXPECT_EQ(a.primitive[i], b.primitive[i]) << i;
    EXPECT_NEAR(a.u[i], b.u[i], 1e-4f) << i;
    EXPECT_NEAR(a.v[i], b.v[i], 1e-4f) << i;
  }
  EXPECT_GT(hits, 50);
}

// Embree stops the program at rays beyond 1.8e18 or that are no numbers, and so it does where an instance takes them
// there.
TEST(TracedScene, RaysBeyondTheRangeOfFloatsMiss) {
  TracedScene scene;
  scene.add(random_mesh(3, false, 1), CutOut::none);
  const uint32_t object = scene.add_object();
  scene.add(random_mesh(4, false, 2), CutOut::none, object);
  const Transform small = Transform::scale(V3d(1e-9, 1e-9, 1e-9));
  scene.add_instance(object, AnimatedTransform(small, small));
  scene.commit();
  const auto t = std::make_unique<Traced>();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const V3f z(0, 0, 1), at(0, 0, -9);
  int n = 0;
  const auto add = [&](const V3f& o, const V3f& d, float t_max) { t->rays.set(n, o, d, t_max, 0, uint32_t(n)), ++n; };
  for (const float bad : {nan, infinity, -infinity, 1e19f, -3e38f, 2e9f}) {
    for (int axis = 0; axis < 3; ++axis) {
      V3f v = at;
      v[axis] = bad;
      add(v, z, infinity);
      if (std::abs(bad) < 1e18f) continue;
      V3f d = z;
      d[axis] = bad;
      add(at, d, infinity);
    }
  }
  add(at, z, nan);
  scene.intersect(t->rays, n, &t->hits);
  RGB passed[RayBatch::capacity];
  scene.transmitted(t->rays, n, passed);
  for (int i = 0; i < n; ++i) {
    EXPECT_EQ(t->hits.geometry[i], no_id) << i;
    EXPECT_EQ(t->hits.instance[i], no_id) << i;
    EXPECT_TRUE(passed[i].is_black()) << i;
  }
}

TEST(TracedScene, ReachOfMotions) {
  const auto scaled = [](double x, double y, double z) { return Transform::scale(V3d(x, y, z)); };
  const auto still = [](const Transform& t) { return instance_reach(AnimatedTransform(t, t)); };
  EXPECT_FLOAT_EQ(still(Transform()), 1e18f);
  EXPECT_FLOAT_EQ(still(scaled(1e-6, 1, 1)), 1e12f);
  EXPECT_FLOAT_EQ(still(Transform::translate(V3d(0, 1e12, 0)) * scaled(1e-6, 1e-6, 1e-6)), 0);
  EXPECT_FLOAT_EQ(still(scaled(1, 1, 1e-12)), 0);
  EXPECT_FLOAT_EQ(still(scaled(1e12, 1, 1)), 0);
  EXPECT_FLOAT_EQ(instance_reach(AnimatedTransform(scaled(1, 1, 1), scaled(1, -1, 1))), 0) << "singular on the way";
  EXPECT_FLOAT_EQ(instance_reach(AnimatedTransform(scaled(-1, 1, 1), scaled(1, -2, 1))), 1e18f)
      << "a mirror that turns";
  EXPECT_THROW(TracedScene().add_instance(0, AnimatedTransform(scaled(1, 1, 1), scaled(1, -1, 1))), Error);
}

// A batch answers what single rays do, and occlusion what nearest hits do.
TEST(TracedScene, OccludedWhereSomethingIsHit) {
  TracedScene scene;
  scene.add(random_mesh(3, false, 3), CutOut::none);
  scene.add(std::make_shared<const geom::Quadric>(
                geom::Quadric::sphere(Transform::translate({1, 0, 0}), .7f, -.7f, .5f, 5, false)),
            CutOut::none);
  scene.commit();
  const auto t = std::make_unique<Traced>();
  const auto single = std::make_unique<Traced>();
  random_rays(4, RayBatch::capacity, &t->rays);
  scene.intersect(t->rays, RayBatch::capacity, &t->hits);
  RGB passed[RayBatch::capacity];
  scene.transmitted(t->rays, RayBatch::capacity, passed);
  for (int i = 0; i < RayBatch::capacity; ++i) {
    EXPECT_EQ(passed[i], RGB(t->hits.geometry[i] == no_id ? 1.0f : 0.0f));
    single->rays.set(0, t->rays.origin(i), t->rays.direction(i), infinity, 0, 0);
    scene.intersect(single->rays, 1, &single->hits);
    EXPECT_EQ(single->hits.geometry[0], t->hits.geometry[i]);
    EXPECT_EQ(single->hits.t[0], t->hits.t[i]);
  }
}

// Quadrics under any affine map: the hit lies on the implicit surface, and the normal is its gradient, outwards.
TEST(TracedScene, SphereUnderMirroringTransformKeepsItsOutside) {
  TracedScene scene;
  const Transform m =
      Transform::translate({.2, -.1, .3}) * Transform::rotate(40, {1, 2, 3}) * Transform::scale({-1.5, .7, 1});
  scene.add(std::make_shared<const geom::Quadric>(geom::Quadric::sphere(m, 1, -1, 1, 2 * pi, false)), CutOut::none);
  scene.commit();
  const auto t = std::make_unique<Traced>();
  random_rays(5, RayBatch::capacity, &t->rays);
  scene.intersect(t->rays, RayBatch::capacity, &t->hits);
  int hits = 0;
  for (int i = 0; i < RayBatch::capacity; ++i) {
    if (t->hits.geometry[i] == no_id) continue;
    ++hits;
    const geom::SurfacePoint s = scene.surface(t->hits, i, 0);
    const V3f local = m.inverse().point(s.P);
    EXPECT_NEAR(length(local), 1, 1e-4);
    EXPECT_GT(dot(s.Ng, normalize(m.normal(local))), 0.999f);
    EXPECT_LT(dot(s.Ng, t->rays.direction(i)), 0) << "seen from outside";
  }
  EXPECT_GT(hits, 30);
}

class Half final : public OpacityTest {
 public:
  void opacity(uint32_t, int n, const uint32_t*, const float*, const float*, const float*,
               float* alpha) const override {
    std::fill_n(alpha, n, 0.5f);
  }
};

// Stochastic opacity lets the right share of rays through, by their keys alone.
TEST(TracedScene, OpacityIsASharePerRay) {
  TracedScene scene;
  const Half half;
  scene.set_opacity_test(&half);
  auto quad = std::make_shared<geom::Mesh>();
  quad->corners = 4;
  quad->P = {V3f(-9, -9, 0), V3f(9, -9, 0), V3f(9, 9, 0), V3f(-9, 9, 0)};
  quad->indices = {0, 1, 2, 3};
  scene.add(MeshPtr(quad), CutOut::gray);
  scene.commit();
  const auto t = std::make_unique<Traced>();
  int hits = 0;
  for (int batch = 0; batch < 64; ++batch) {
    for (int i = 0; i < RayBatch::capacity; ++i)
      t->rays.set(i, V3f(0, 0, 1), V3f(0, 0, -1), infinity, 0, uint32_t(batch * RayBatch::capacity + i));
    scene.intersect(t->rays, RayBatch::capacity, &t->hits);
    for (int i = 0; i < RayBatch::capacity; ++i) hits += t->hits.geometry[i] != no_id;
  }
  const double n = 64.0 * RayBatch::capacity;
  EXPECT_NEAR(hits / n, 0.5, 5 * 0.5 / std::sqrt(n));
  RGB passed[RayBatch::capacity];
  scene.transmitted(t->rays, RayBatch::capacity, passed);
  for (const RGB& p : passed) EXPECT_NEAR(p.g, 0.5f, 1e-6f) << "shadow rays need no luck";
}

class Tinted final : public OpacityTest {
 public:
  static constexpr RGB of[] = {RGB(1, 0.5f, 0), RGB(0.2f, 0.7f, 0.2f), RGB(1)};
  void opacity(uint32_t, int n, const uint32_t*, const float*, const float*, const float*,
               float* alpha) const override {
    std::fill_n(alpha, n, 1.0f);
  }
  void colored_opacity(uint32_t geometry, int n, const uint32_t*, const float*, const float*, const float*,
                       RGB* alpha) const override {
    std::fill_n(alpha, n, of[geometry]);
  }
};

// Panes of opacities a, b and c = 1, in any order of their numbers: weighted, a of the rays end on the first, (1 - a) b
// on the second, the rest on the third, in each channel. Shadow rays that end before the third bring (1 - a) (1 - b).
// Panes are quads, a quadric and instances; scenes are repeated or not.
TEST(TracedScene, ColoredOpacityIsASharePerRayAndChannel) {
  for (const bool instanced : {false, true})
    for (const bool repeated : {false, true})
      for (const float sign : {-1.0f, 1.0f}) {
        TracedScene scene;
        const Tinted tinted;
        scene.set_opacity_test(&tinted);
        const uint32_t object = instanced ? scene.add_object() : no_id;
        for (int g = 0; g < 3; ++g) {
          const float z = sign * float(2 - g);
          auto quad = std::make_shared<geom::Mesh>();
          quad->corners = 4;
          quad->P = {V3f(-2, -2, z), V3f(2, -2, z), V3f(2, 2, z), V3f(-2, 2, z)};
          quad->indices = {0, 1, 2, 3};
          const auto disk = std::make_shared<geom::Quadric>(geom::Quadric::disk(Transform(), z, 2, 0, 2 * pi, false));
          scene.add(g == 1 ? Shape(QuadricPtr(disk)) : Shape(MeshPtr(quad)), g < 2 ? CutOut::colored : CutOut::none,
                    object);
        }
        if (instanced) scene.add_instance(object, {});
        if (repeated) scene.set_period(Box2f(V2f(-1, -1), V2f(1, 1)));
        scene.commit();
        ASSERT_TRUE(scene.has_colored_opacity());
        const auto t = std::make_unique<Traced>();
        RGB passed[RayBatch::capacity];
        RGB ended[3], shadow;
        constexpr int batches = 256;
        // Across borders of a repeated scene.
        const V3f d = normalize(V3f(0.3f, 0.1f, -sign));
        for (int batch = 0; batch < batches; ++batch) {
          for (int i = 0; i < RayBatch::capacity; ++i)
            t->rays.set(i, V3f(0, 0, sign * 2.5f), d, 2.4f / std::abs(d.z), 0, uint32_t(hash(batch, i)));
          scene.transmitted(t->rays, RayBatch::capacity, passed);
          for (int i = 0; i < RayBatch::capacity; ++i) t->rays.t_max[i] = infinity;
          scene.intersect(t->rays, RayBatch::capacity, &t->hits);
          for (int i = 0; i < RayBatch::capacity; ++i) {
            ASSERT_NE(t->hits.geometry[i], no_id);
            ended[t->hits.geometry[i]] += t->hits.weight(i);
            shadow += passed[i];
            // Behind what Embree meets once, nothing is left to chance but the quadric's draw.
            for (int c = 0; c < 3; ++c)
              EXPECT_TRUE(passed[i][c] == 0 || std::abs(passed[i][c] - (1 - Tinted::of[0][c])) < 1e-5f) << passed[i][c];
          }
        }
        const float n = float(batches) * RayBatch::capacity;
        for (int c = 0; c < 3; ++c) {
          const float a = Tinted::of[0][c], b = Tinted::of[1][c], through = (1 - a) * (1 - b);
          EXPECT_NEAR(ended[0][c] / n, a, 0.02f) << c;
          EXPECT_NEAR(ended[1][c] / n, (1 - a) * b, 0.02f) << c;
          EXPECT_NEAR(ended[2][c] / n, through, 0.02f) << c;
          EXPECT_NEAR(shadow[c] / n, through, 0.02f) << c;
        }
      }
}

class Listener final : public OpacityTest {
 public:
  void opacity(uint32_t, int n, const uint32_t*, const float*, const float*, const float*,
               float* alpha) const override {
    std::fill_n(alpha, n, 1.0f);
  }
  float seen_opacity(const Hit& hit, Counts* counts) const override {
    seen = hit;
    ++counts->lookups;
    return 1;
  }
  void add(const Counts& counts) const override { lookups += counts.lookups; }
  mutable Hit seen{};
  mutable uint64_t lookups = 0;
};

// A ray's footprint comes to the test in the space of what was hit, with the size of that there; counts come a batch.
TEST(TracedScene, TellsTheOpacityTestOfTheFootprint) {
  TracedScene scene;
  const Listener listener;
  scene.set_opacity_test(&listener);
  auto quad = std::make_shared<geom::Mesh>();
  quad->corners = 4;
  quad->P = {V3f(-2, -3, 0), V3f(2, -3, 0), V3f(2, 3, 0), V3f(-2, 3, 0)};
  quad->indices = {0, 1, 2, 3};
  const uint32_t object = scene.add_object();
  scene.add(MeshPtr(quad), CutOut::gray);
  scene.add(MeshPtr(quad), CutOut::gray, object);
  const Transform far = Transform::translate(V3d(100, 0, 0)) * Transform::scale(V3d(5, 5, 5));
  scene.add_instance(object, AnimatedTransform(far, far));
  scene.commit();
  const auto t = std::make_unique<Traced>();
  for (const float x : {0.5f, 100.5f}) {
    t->rays.set(0, V3f(x, 0.25f, 10), V3f(0, 0, -1), infinity, 0.5f, 0, 0.5f, 0.1f);
    const auto check = [&](const char* kind) {
      EXPECT_EQ(listener.seen.geometry, x < 50 ? 0u : 1u) << kind;
      EXPECT_NEAR(listener.seen.width, x < 50 ? 1.5f : 0.3f, 1e-4f) << kind;
      EXPECT_NEAR(listener.seen.area, 24, 1e-3f) << kind;
      EXPECT_EQ(listener.seen.time, 0.5f) << kind;
    };
    scene.intersect(t->rays, 1, &t->hits);
    check("nearest hit");
    RGB passed(1);
    scene.transmitted(t->rays, 1, &passed);
    EXPECT_TRUE(passed.is_black());
    check("shadow ray");
  }
  EXPECT_EQ(listener.lookups, 4u);
}

// Tests of what does not depend on the number of threads would not test it. Embree may limit a process to its
// processors.
TEST(Threads, AreAsManyAsAskedFor) {
  const int count = 2 * int(std::thread::hardware_concurrency()) + 1;
  set_thread_count(count);
  {
    const TracedScene scene;
    std::atomic<int> together{0};
    const Timer timer;
    parallel_for(size_t(count), [&](size_t) {
      ++together;
      while (together < count && timer.seconds() < 20) std::this_thread::yield();
    });
    EXPECT_LT(timer.seconds(), 20);
    set_thread_count(1);
    std::atomic<int> inside{0};
    parallel_for(100, [&](size_t) {
      EXPECT_EQ(++inside, 1);
      std::this_thread::yield();
      --inside;
    });
  }
  set_thread_count(0);
}

}  // namespace
}  // namespace dapple::trace
