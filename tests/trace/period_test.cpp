// SPDX-License-Identifier: Apache-2.0
// Repeated scenes and clouds of disks.
#include <gtest/gtest.h>

#include "dapple/base/hash.h"
#include "dapple/numeric/warp.h"
#include "dapple/trace/traced_scene.h"

namespace dapple::trace {
namespace {

constexpr float side = 3;

DisksPtr random_disks(int count, uint64_t key) {
  auto cloud = std::make_shared<geom::DiskCloud>();
  KeyedRng rng(key);
  for (int i = 0; i < count; ++i) {
    cloud->disks.push_back({V3f(side * rng.next(), side * rng.next(), 2 * rng.next()), 0.1f + 0.3f * rng.next()});
    cloud->normals.push_back(square_to_sphere(V2f(rng.next(), rng.next())));
  }
  return cloud;
}

void place(TracedScene* scene, uint32_t object, int from, int to) {
  for (int j = from; j <= to; ++j)
    for (int i = from; i <= to; ++i) {
      const Transform t = Transform::translate(V3d(i * side, j * side, 0));
      scene->add_instance(object, AnimatedTransform(t, t));
    }
}

void slanted_rays(int n, RayBatch* rays) {
  KeyedRng rng(7);
  for (int i = 0; i < n; ++i) {
    V3f d = square_to_sphere(V2f(rng.next(), rng.next()));
    d.z = d.z > 0 ? d.z + 0.1f : d.z - 0.1f;
    if (i % 16 == 0) d = V3f(0, 0, i % 32 ? 1 : -1);
    rays->set(i, V3f(side * rng.next(), side * rng.next(), 2 * rng.next()), normalize(d),
              i % 3 ? infinity : 4 * rng.next(), 0, uint32_t(i));
  }
}

// Rationale: a repeated scene is the same as very many copies. Expectation: the same hits, distances and occlusions as
// among 17 x 17 copies (rays leave the layer within those), but for rays that graze an edge of a leaf.
TEST(Period, IsManyCopies) {
  TracedScene repeated, copies;
  for (TracedScene* scene : {&repeated, &copies}) {
    const uint32_t object = scene->add_object();
    scene->add(random_disks(60, 3), CutOut::none, object);
    place(scene, object, scene == &repeated ? -1 : -8, scene == &repeated ? 1 : 8);
  }
  repeated.set_period(Box2f(V2f(0, 0), V2f(side, side)));
  repeated.commit(), copies.commit();
  const auto rays = std::make_unique<RayBatch>();
  const auto a = std::make_unique<HitBatch>(), b = std::make_unique<HitBatch>();
  constexpr int n = RayBatch::capacity;
  slanted_rays(n, rays.get());
  repeated.intersect(*rays, n, a.get());
  copies.intersect(*rays, n, b.get());
  RGB passed_a[n], passed_b[n];
  repeated.transmitted(*rays, n, passed_a);
  copies.transmitted(*rays, n, passed_b);
  int hits = 0, differ = 0, far = 0;
  for (int i = 0; i < n; ++i) {
    if (a->geometry[i] != b->geometry[i] || passed_a[i] != passed_b[i] || a->primitive[i] != b->primitive[i]) {
      differ += a->geometry[i] != no_id || b->geometry[i] != no_id || passed_a[i] != passed_b[i];
      continue;
    }
    if (a->geometry[i] == no_id) continue;
    ++hits;
    far += a->t[i] > side;
    EXPECT_NEAR(a->t[i], b->t[i], 1e-4f * (1 + b->t[i]));
    // The same place but for whole cells.
    const V3f p = repeated.surface(*a, i, 0).P, q = copies.surface(*b, i, 0).P;
    for (int k = 0; k < 2; ++k) EXPECT_NEAR(std::remainder(p[k] - q[k], side), 0, 1e-3f);
    EXPECT_NEAR(p.z, q.z, 1e-4f);
  }
  EXPECT_LE(differ, 1);
  EXPECT_GT(hits, n / 3);
  EXPECT_GT(far, 5) << "rays cross borders";
}

// Rationale: hits on disks get their place from us. Expectation: the surface point lies on the ray and in the disk,
// also in an instance that is turned, scaled and mirrored; u and v give it back.
TEST(Disks, SurfaceLiesOnTheRay) {
  const DisksPtr cloud = random_disks(90, 5);
  TracedScene scene;
  const uint32_t object = scene.add_object();
  scene.add(cloud, CutOut::none, object);
  const Transform t =
      Transform::translate({0.3, -1, 2}) * Transform::rotate(40, {1, 2, 3}) * Transform::scale({1.5, -1.5, 1.5});
  scene.add_instance(object, AnimatedTransform(t, t));
  scene.add(cloud, CutOut::none);
  scene.commit();
  const auto rays = std::make_unique<RayBatch>();
  const auto hits = std::make_unique<HitBatch>();
  KeyedRng rng(9);
  constexpr int n = RayBatch::capacity;
  for (int i = 0; i < n; ++i) {
    const V3f o = square_to_sphere(V2f(rng.next(), rng.next())) * 9.0f,
              to(side * rng.next(), side * rng.next(), 2 * rng.next());
    rays->set(i, o, normalize(to - o), infinity, 0, uint32_t(i));
  }
  scene.intersect(*rays, n, hits.get());
  int instanced = 0, plain = 0;
  for (int i = 0; i < n; ++i) {
    if (hits->geometry[i] == no_id) continue;
    ++(hits->instance[i] == no_id ? plain : instanced);
    const geom::SurfacePoint s = scene.surface(*hits, i, 0);
    EXPECT_LT(length(rays->origin(i) + rays->direction(i) * hits->t[i] - s.P), 1e-4f);
    EXPECT_NEAR(length(s.Ng), 1, 1e-5f);
    EXPECT_NEAR(dot(s.Ng, s.dPdv) / length(s.dPdv), 0, 1e-4f);
    EXPECT_GE(hits->v[i], 0);
    EXPECT_LE(hits->v[i], 1);
  }
  EXPECT_GT(plain, 20);
  EXPECT_GT(instanced, 10);
}

TEST(Disks, RefuseToBecomeEllipses) {
  geom::DiskCloud cloud = *random_disks(3, 1);
  const geom::DiskCloud before = cloud;
  EXPECT_FALSE(cloud.transform(Transform::scale({1, 1, 2}), false));
  EXPECT_EQ(cloud.disks[0].radius, before.disks[0].radius);
  EXPECT_TRUE(cloud.transform(Transform::rotate(30, {1, 0, 1}) * Transform::scale({2, 2, 2}), true));
  EXPECT_NEAR(cloud.disks[0].radius, 2 * before.disks[0].radius, 1e-6f);
}

}  // namespace
}  // namespace dapple::trace
