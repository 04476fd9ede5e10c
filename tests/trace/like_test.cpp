// SPDX-License-Identifier: Apache-2.0
// Scenes that take over what another has: rays meet in them what they meet in one that was built by itself.
#include <gtest/gtest.h>

#include "dapple/base/hash.h"
#include "dapple/trace/traced_scene.h"

namespace dapple::trace {
namespace {

/// Made anew each time, as a scene that is built again reads its files again.
MeshPtr random_triangles(uint64_t key, uint32_t count) {
  auto mesh = std::make_shared<geom::Mesh>();
  KeyedRng rng(key);
  for (uint32_t i = 0; i < count; ++i) {
    const V3f middle(4 * rng.next() - 2, 4 * rng.next() - 2, 4 * rng.next() - 2);
    for (uint32_t c = 0; c < 3; ++c) {
      mesh->P.push_back(middle + V3f(rng.next(), rng.next(), rng.next()) * 0.4f);
      mesh->indices.push_back(3 * i + c);
    }
  }
  return mesh;
}

QuadricPtr ball(double x) {
  return std::make_shared<const geom::Quadric>(
      geom::Quadric::sphere(Transform::translate(V3d(x, 0, 0)), 0.5f, -0.5f, 0.5f, 2 * pi, false));
}

/// By geometry, primitive and place, so that a wrong number shows.
class Patchy final : public OpacityTest {
 public:
  void opacity(uint32_t geometry, int n, const uint32_t* primitive, const float* u, const float*, const float*,
               float* alpha) const override {
    for (int i = 0; i < n; ++i) alpha[i] = (hash(geometry, primitive[i]) & 1) && u[i] < 0.5f ? 0.0f : 1.0f;
  }
};

struct Content {
  std::vector<uint64_t> top{1, 2, 3};  ///< keys of meshes; the middle one is cut out
  std::vector<uint64_t> tree{10, 11};  ///< the same of an object, whose second is cut out, with a ball
  std::vector<double> places{-1, 0, 1};
  bool bush = true;     ///< another object
  bool placed = false;  ///< the bush stands in the tree, behind a portal
};

std::unique_ptr<TracedScene> make(const Content& content, const OpacityTest* test, const TracedScene* like) {
  constexpr uint32_t faces = 3000;
  auto scene = std::make_unique<TracedScene>(like);
  scene->set_opacity_test(test);
  const uint32_t tree = scene->add_object(), bush = scene->add_object();
  for (size_t i = 0; i < content.top.size(); ++i)
    scene->add(random_triangles(content.top[i], 200), content.top[i] == 2 ? CutOut::gray : CutOut::none);
  scene->add(ball(2), CutOut::none);
  for (size_t i = 0; i < content.tree.size(); ++i)
    scene->add(random_triangles(content.tree[i], faces), i == 1 ? CutOut::gray : CutOut::none, tree);
  scene->add(ball(0), CutOut::none, tree);
  if (content.bush) scene->add(random_triangles(20, faces), CutOut::none, bush);
  if (content.placed) {
    PlacementSet set;
    const float rows[3][4] = {{.5f, 0, 0, 1}, {0, .5f, 0, 0}, {0, 0, .5f, 0}};
    set.add(rows);
    scene->add_placements(bush, std::move(set), tree);
  }
  for (const double x : content.places) {
    const AnimatedTransform at(Transform::translate(V3d(x, 0, 0)), Transform::translate(V3d(x, x == 0 ? .2 : 0, 0)));
    if (!content.placed) scene->add_instance(tree, at);
    scene->add_instance(bush,
                        AnimatedTransform(Transform::translate(V3d(0, x, 0)), Transform::translate(V3d(0, x, 0))));
  }
  if (content.placed) {
    PlacementSet set;
    const float rows[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
    set.add(rows);
    scene->add_placements(tree, std::move(set));
  }
  scene->commit();
  return scene;
}

void expect_same_hits(const TracedScene& a, const TracedScene& b) {
  const auto x = std::make_unique<HitBatch>(), y = std::make_unique<HitBatch>();
  const auto rays = std::make_unique<RayBatch>();
  KeyedRng rng(4);
  const int n = RayBatch::capacity;
  int hits = 0, instanced = 0;
  for (int batch = 0; batch < 40; ++batch) {
    for (int i = 0; i < n; ++i) {
      const V3f o(8 * rng.next() - 4, 8 * rng.next() - 4, -6), to(4 * rng.next() - 2, 4 * rng.next() - 2, 0);
      rays->set(i, o, normalize(to - o), infinity, rng.next(), uint32_t(i));
    }
    a.intersect(*rays, n, x.get());
    b.intersect(*rays, n, y.get());
    RGB p[RayBatch::capacity], q[RayBatch::capacity];
    for (int i = 0; i < n; ++i) rays->t_max[i] = 6;
    a.transmitted(*rays, n, p);
    b.transmitted(*rays, n, q);
    for (int i = 0; i < n; ++i) {
      ASSERT_EQ(x->geometry[i], y->geometry[i]);
      ASSERT_EQ(p[i].r, q[i].r);
      if (x->geometry[i] == no_id) continue;
      ASSERT_EQ(x->instance[i], y->instance[i]);
      ASSERT_EQ(x->primitive[i], y->primitive[i]);
      ASSERT_EQ(x->t[i], y->t[i]);
      ASSERT_EQ(x->u[i], y->u[i]);
      const geom::SurfacePoint s = a.surface(*x, i, rays->time[i]), t = b.surface(*y, i, rays->time[i]);
      ASSERT_EQ(s.P, t.P);
      ASSERT_EQ(s.Ns, t.Ns);
      ++hits;
      instanced += x->instance[i] != no_id;
    }
  }
  EXPECT_GT(hits, 1000);
  EXPECT_GT(instanced, 500);
}

// Expectation: hits are those of a scene that was built by itself, also when the other one has gone; and what was the
// same was not built again, which the memory of their common device shows: 6000 triangles take 50 bytes each at least.
TEST(ScenesAlike, MeetWhatTheyWouldHaveMetAlone) {
  const Patchy test;
  const Content before;
  Content moved, hidden, shown, changed, without_bush, placed, other_tree;
  moved.places = {-1, 0.3, 1};
  hidden.top = {1, 3};
  shown.top = {7, 1, 2, 3};
  changed.top = {1, 2, 4};
  without_bush.bush = false;
  placed.placed = true;
  other_tree.tree = {10, 12};
  const auto check = [&](const char* name, const Content& after, bool keeps_the_tree) {
    SCOPED_TRACE(name);
    auto first = make(before, &test, nullptr);
    const size_t one = first->acceleration_bytes();
    const auto alone = make(after, &test, nullptr), second = make(after, &test, first.get());
    const size_t more = second->acceleration_bytes() - one;
    EXPECT_EQ(more < 6000 * 50, keeps_the_tree) << more;
    first.reset();
    expect_same_hits(*alone, *second);
    const auto third = make(before, &test, second.get());
    expect_same_hits(*make(before, &test, nullptr), *third);
  };
  check("moved", moved, true);
  check("changed", changed, true);
  check("nothing", before, true);
  // What is cut out is known by its number, which changes.
  check("hidden", hidden, false);
  check("shown", shown, false);
  check("without the bush", without_bush, true);
  check("other tree", other_tree, false);
  check("placed in the tree", placed, false);
}

}  // namespace
}  // namespace dapple::trace
