// SPDX-License-Identifier: Apache-2.0
// Parts of a traced scene, for rays that are not to meet the rest.
#include <gtest/gtest.h>

#include "dapple/base/hash.h"
#include "dapple/trace/traced_scene.h"

namespace dapple::trace {
namespace {

MeshPtr random_triangles(uint64_t key) {
  auto mesh = std::make_shared<geom::Mesh>();
  KeyedRng rng(key);
  for (uint32_t i = 0; i < 120; ++i) {
    mesh->P.emplace_back(4 * rng.next() - 2, 4 * rng.next() - 2, 4 * rng.next() - 2);
    mesh->indices.push_back(i);
  }
  return mesh;
}

/// A mesh, and instances of two objects of which those that `there` says are added.
void fill(const std::vector<uint8_t>& there, TracedScene* scene) {
  scene->add(random_triangles(1), CutOut::none);
  const uint32_t a = scene->add_object(), b = scene->add_object();
  scene->add(random_triangles(2), CutOut::none, a);
  scene->add(random_triangles(3), CutOut::none, b);
  for (size_t i = 0; i < there.size(); ++i) {
    const Transform at = Transform::translate(V3d(double(i) - 2, 0.3 * double(i), 0));
    if (there[i]) scene->add_instance(i % 2 ? b : a, AnimatedTransform(at, at));
  }
  scene->commit();
}

// Expectation: hits are those of a scene that never had the other instances, and instances keep their numbers.
TEST(Parts, MeetWhatAPartHolds) {
  const std::vector<uint8_t> all{1, 1, 1, 1, 1}, some{0, 1, 0, 1, 1};
  const std::vector<uint32_t> number{1, 3, 4};  // of what the small scene has
  TracedScene whole, small;
  fill(all, &whole);
  fill(some, &small);
  const auto part = whole.make_part(some), nothing = whole.make_part({0, 0, 0, 0, 0}),
             everything = whole.make_part(all);
  RayBatch rays{};
  KeyedRng rng(4);
  const int n = RayBatch::capacity;
  for (int i = 0; i < n; ++i) {
    const V3f o(8 * rng.next() - 4, 8 * rng.next() - 4, -6), to(4 * rng.next() - 2, 4 * rng.next() - 2, 0);
    rays.set(i, o, normalize(to - o), infinity, 0, uint32_t(i));
  }
  const auto found = std::make_unique<HitBatch>(), expected = std::make_unique<HitBatch>();
  whole.intersect(*part, rays, n, found.get());
  small.intersect(rays, n, expected.get());
  int instanced = 0;
  for (int i = 0; i < n; ++i) {
    ASSERT_EQ(found->geometry[i], expected->geometry[i]);
    if (expected->geometry[i] == no_id) continue;
    EXPECT_EQ(found->t[i], expected->t[i]);
    EXPECT_EQ(found->primitive[i], expected->primitive[i]);
    const uint32_t instance = expected->instance[i];
    EXPECT_EQ(found->instance[i], instance == no_id ? no_id : number[instance]);
    instanced += instance != no_id;
  }
  EXPECT_GT(instanced, 50);
  whole.intersect(*everything, rays, n, found.get());
  whole.intersect(rays, n, expected.get());
  for (int i = 0; i < n; ++i) EXPECT_EQ(found->t[i], expected->t[i]);
  whole.intersect(*nothing, rays, n, found.get());
  for (int i = 0; i < n; ++i) EXPECT_EQ(found->instance[i], no_id);
}

}  // namespace
}  // namespace dapple::trace
