// SPDX-License-Identifier: Apache-2.0
// Objects placed in objects: what rays meet, and how it is named, against the same shapes each placed by itself.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <set>

#include "dapple/base/error.h"
#include "dapple/base/hash.h"
#include "dapple/trace/object_paths.h"
#include "dapple/trace/traced_scene.h"

namespace dapple::trace {
namespace {

using Rows = std::array<std::array<double, 4>, 3>;

Rows product(const Rows& a, const Rows& b) {
  Rows out;
  for (size_t r = 0; r < 3; ++r)
    for (size_t c = 0; c < 4; ++c) {
      out[r][c] = c == 3 ? a[r][3] : 0;
      for (size_t k = 0; k < 3; ++k) out[r][c] += a[r][k] * b[k][c];
    }
  return out;
}

Rows random_map(KeyedRng& rng, double spread, double scale) {
  Rows m;
  for (size_t r = 0; r < 3; ++r)
    for (size_t c = 0; c < 4; ++c)
      m[r][c] = c == 3 ? spread * (2 * double(rng.next()) - 1)
                       : scale * ((r == c ? (rng.next() < 0.3f ? -1.0 : 1.0) : 0) + 0.4 * (double(rng.next()) - 0.5));
  // As floats, so that both scenes have the same maps.
  for (auto& row : m)
    for (double& x : row) x = double(float(x));
  return m;
}

void add(const Rows& m, PlacementSet* set) {
  float rows[3][4];
  for (size_t r = 0; r < 3; ++r)
    for (size_t c = 0; c < 4; ++c) rows[r][c] = float(m[r][c]);
  set->add(rows);
}

AnimatedTransform still(const Rows& m) {
  M44d matrix;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) matrix[r][c] = m[size_t(r)][size_t(c)];
  const Transform t(matrix);
  return AnimatedTransform(t, t);
}

MeshPtr random_triangles(uint64_t key, uint32_t count, float spread, float size) {
  auto mesh = std::make_shared<geom::Mesh>();
  KeyedRng rng(key);
  const auto point = [&rng](float s) { return V3f(rng.next() - 0.5f, rng.next() - 0.5f, rng.next() - 0.5f) * (2 * s); };
  for (uint32_t i = 0; i < 3 * count; ++i) {
    if (i % 3 == 0)
      mesh->P.push_back(point(spread));
    else
      mesh->P.push_back(mesh->P[i - i % 3] + point(size));
    mesh->indices.push_back(i);
  }
  return mesh;
}

QuadricPtr ball(float radius) {
  return std::make_shared<geom::Quadric>(geom::Quadric::sphere(Transform(), radius, -radius, radius, 2 * pi, false));
}

/// Half of each primitive is there.
class Halves final : public OpacityTest {
 public:
  void opacity(uint32_t, int n, const uint32_t*, const float*, const float*, const float*,
               float* alpha) const override {
    std::fill_n(alpha, n, 0.5f);
  }
  float seen_opacity(const Hit& hit, Counts*) const override {
    widths[hit.geometry] = hit.width;
    return hit.u > 0.4f ? 1.0f : 0.0f;
  }
  mutable std::map<uint32_t, float> widths;
};

/// Four levels of random triangles and balls, nested, and the same flat: an instance for each path.
struct Pair {
  TracedScene nested, flat;
  std::vector<MeshPtr> meshes;

  explicit Pair(CutOut cut_out = CutOut::none, bool crowded = true) {
    KeyedRng rng(5);
    const uint32_t counts[4] = {7, 5, 4, 3};  // forest, tree, branch, leaf
    const double spreads[4] = {20, 2, 0.7, 0.3}, scales[4] = {1, 0.6, 0.5, 0.7};
    std::vector<uint32_t> objects, flat_objects;
    for (uint32_t level = 0; level < 4; ++level) {
      meshes.push_back(random_triangles(level + 1, crowded ? 30 : 6, float(spreads[level]) / 3, 0.4f));
      objects.push_back(nested.add_object());
      flat_objects.push_back(flat.add_object());
      nested.add(meshes.back(), cut_out, objects.back());
      flat.add(meshes.back(), cut_out, flat_objects.back());
      nested.add(ball(0.2f), cut_out, objects.back());
      flat.add(ball(0.2f), cut_out, flat_objects.back());
    }
    // Objects are placed from the innermost out. A leaf is also placed in the tree directly.
    std::vector<std::vector<Rows>> maps(4);
    for (uint32_t level = 0; level < 4; ++level)
      for (uint32_t i = 0; i < counts[level]; ++i)
        maps[level].push_back(random_map(rng, spreads[level], scales[level]));
    for (int level = 3; level >= 0; --level) {
      PlacementSet set;
      for (const Rows& m : maps[size_t(level)]) add(m, &set);
      EXPECT_EQ(nested.add_placements(objects[size_t(level)], std::move(set),
                                      level == 0 ? no_id : objects[size_t(level) - 1]),
                0u);
    }
    PlacementSet extra;
    const Rows direct = random_map(rng, 1, 0.8);
    add(direct, &extra);
    // Leaves, straight in the scene too.
    EXPECT_EQ(nested.add_placements(objects[3], std::move(extra)), 0u);
    flat.add_instance(flat_objects[3], still(direct));
    for (const Rows& a : maps[0]) {
      flat.add_instance(flat_objects[0], still(a));
      for (const Rows& b : maps[1]) {
        flat.add_instance(flat_objects[1], still(product(a, b)));
        for (const Rows& c : maps[2]) {
          flat.add_instance(flat_objects[2], still(product(product(a, b), c)));
          for (const Rows& d : maps[3])
            flat.add_instance(flat_objects[3], still(product(product(product(a, b), c), d)));
        }
      }
    }
    const uint32_t ground[] = {nested.add(random_triangles(9, 10, 15, 5), CutOut::none),
                               flat.add(random_triangles(9, 10, 15, 5), CutOut::none)};
    EXPECT_EQ(ground[0], ground[1]);
    nested.commit(), flat.commit();
  }
};

// Towards what stands at the ends of paths.
int fill_rays(const TracedScene& scene, uint64_t key, RayBatch* rays, bool joined) {
  KeyedRng rng(key);
  const int n = RayBatch::capacity;
  V3f o(0, 0, 0);
  for (int i = 0; i < n; ++i) {
    if (!joined || i % 16 == 0) o = V3f(60 * rng.next() - 30, 60 * rng.next() - 30, 60 * rng.next() - 30);
    const uint32_t path = uint32_t(rng.next() * float(scene.instance_count()));
    const V3f to = scene.instance_point(path, V3f(rng.next() - 0.5f, rng.next() - 0.5f, rng.next() - 0.5f));
    rays->set(i, o, normalize(to - o), infinity, 0, uint32_t(i), 0.01f, 0.02f);
    rays->joined[i] = joined && i % 16 > 0;
  }
  return n;
}

struct Comparison {
  int hits = 0, on_paths = 0, other = 0;
};

// Where both met the same primitive the surfaces are the same, to rounding. Rays that graze an edge may differ.
Comparison compare(const Pair& p, bool joined) {
  const auto rays = std::make_unique<RayBatch>();
  const auto a = std::make_unique<HitBatch>(), b = std::make_unique<HitBatch>();
  Comparison found;
  for (uint64_t batch = 0; batch < 40; ++batch) {
    const int n = fill_rays(p.nested, 100 + batch, rays.get(), joined);
    p.nested.intersect(*rays, n, a.get());
    p.flat.intersect(*rays, n, b.get());
    for (int i = 0; i < n; ++i) {
      if (a->geometry[i] == no_id && b->geometry[i] == no_id) continue;
      if (a->geometry[i] != b->geometry[i] || a->primitive[i] != b->primitive[i] ||
          (a->instance[i] == no_id) != (b->instance[i] == no_id)) {
        ++found.other;
        continue;
      }
      ++found.hits;
      EXPECT_NEAR(a->t[i], b->t[i], 2e-5f * b->t[i]);
      if (a->instance[i] == no_id) continue;
      ++found.on_paths;
      const auto s = p.nested.surface(*a, i, 0), t = p.flat.surface(*b, i, 0);
      EXPECT_LT(std::abs(dot(s.P - t.P, t.Ng)), s.error);
      EXPECT_LT(length(s.P - t.P), 1e-3f);  // where a ray grazes, along the surface
      EXPECT_GT(dot(s.Ng, t.Ng), 1 - 1e-5f);
      EXPECT_LT(length(s.P - (rays->origin(i) + rays->direction(i) * a->t[i])), 4 * s.error + 1e-5f);
      float m[3][4], expected[3][4];
      p.nested.instance_rows(a->instance[i], 0, m);
      p.flat.instance_rows(b->instance[i], 0, expected);
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 4; ++c) EXPECT_NEAR(m[r][c], expected[r][c], 1e-6f * (1 + std::abs(expected[r][c])));
      EXPECT_NEAR(p.nested.instance_scale(a->instance[i]), p.flat.instance_scale(b->instance[i]), 1e-5f);
      EXPECT_EQ(p.nested.object_of(a->instance[i]), p.flat.object_of(b->instance[i]));
    }
  }
  return found;
}

TEST(Portals, MeetWhatFlatGeometryMeets) {
  const Pair p;
  EXPECT_EQ(p.nested.instance_count(), 7u * (1 + 5 * (1 + 4 * (1 + 3))) + 1);
  EXPECT_EQ(p.nested.instance_count(), p.flat.instance_count());
  for (const bool joined : {false, true}) {
    const Comparison found = compare(p, joined);
    EXPECT_GT(found.on_paths, 3000);
    EXPECT_LE(found.other, 4);
  }
}

// Rationale: rays that stay together take another way through portals than single ones. Expectation: they meet the
// same, in packets that enter one placement as a whole, and in such as come apart.
TEST(Portals, MeetTheSameInPackets) {
  const Pair p;
  const auto rays = std::make_unique<RayBatch>();
  const auto a = std::make_unique<HitBatch>(), b = std::make_unique<HitBatch>();
  RGB lit_a[RayBatch::capacity], lit_b[RayBatch::capacity];
  KeyedRng rng(77);
  int hits = 0, other = 0;
  for (int batch = 0; batch < 60; ++batch) {
    const float apart = batch % 2 == 0 ? 0.02f : 3.0f;
    V3f o(0, 0, 0), d(0, 0, 1);
    for (int i = 0; i < RayBatch::capacity; ++i) {
      const V3f aside = V3f(rng.next() - 0.5f, rng.next() - 0.5f, rng.next() - 0.5f) * apart;
      if (i % RayBatch::packet == 0) {
        const V3f to = p.nested.instance_point(uint32_t(rng.next() * float(p.nested.instance_count())), V3f(0, 0, 0));
        d = normalize(V3f(rng.next() - 0.5f, rng.next() - 0.5f, rng.next() - 0.5f));
        o = to - d * 40;
      }
      rays->set(i, o + aside, d, batch % 3 == 0 ? 40 : infinity, 0, uint32_t(i));
    }
    p.nested.intersect(*rays, RayBatch::capacity, a.get());
    p.nested.transmitted(*rays, RayBatch::capacity, lit_a);
    for (int i = 0; i < RayBatch::capacity; ++i) rays->joined[i] = i % RayBatch::packet != 0;
    p.nested.intersect(*rays, RayBatch::capacity, b.get());
    p.nested.transmitted(*rays, RayBatch::capacity, lit_b);
    for (int i = 0; i < RayBatch::capacity; ++i) {
      EXPECT_EQ(lit_a[i].r, a->geometry[i] == no_id ? 1.0f : 0.0f);
      if (a->geometry[i] == no_id && b->geometry[i] == no_id) continue;
      const bool same = a->geometry[i] == b->geometry[i] && a->primitive[i] == b->primitive[i] &&
                        a->instance[i] == b->instance[i] && lit_a[i].r == lit_b[i].r &&
                        std::abs(a->t[i] - b->t[i]) < 2e-5f * a->t[i];
      ++(same ? hits : other);
    }
  }
  EXPECT_GT(hits, 3000);
  EXPECT_LE(other, 8);  // where rays graze
}

// Every path has a number of its own: those of all hits name the very placements that were hit.
TEST(Portals, CountEachPathOnce) {
  const Pair p;
  std::map<std::pair<uint32_t, std::array<int, 3>>, int> seen;
  for (uint32_t i = 0; i < p.nested.instance_count(); ++i) {
    const V3f at = p.nested.instance_point(i, V3f(0.1f, 0.2f, 0.3f)) * 1e3f;
    ++seen[{p.nested.object_of(i), {int(at.x), int(at.y), int(at.z)}}];
  }
  EXPECT_GE(seen.size(), p.nested.instance_count() - 2);  // by rounding two may share a cell of a millimetre
}

// Expectation: by object, every path of it once, and the number that placements give it.
TEST(Portals, CountPathsByObject) {
  const Pair p;
  const ObjectPaths paths(p.nested);
  EXPECT_EQ(paths.objects().size(), 4u);
  std::set<uint32_t> seen;
  for (const uint32_t object : paths.objects())
    for (uint64_t i = 0; i < paths.count(object); ++i) {
      const uint32_t instance = paths.instance(object, i);
      EXPECT_EQ(p.nested.object_of(instance), object);
      EXPECT_TRUE(seen.insert(instance).second);
    }
  EXPECT_EQ(seen.size(), p.nested.instance_count());
}

TEST(Portals, LetShadowRaysThroughAsFlatGeometryDoes) {
  const Pair p(CutOut::none, false);
  const auto rays = std::make_unique<RayBatch>();
  int lit = 0, dark = 0, other = 0;
  for (uint64_t batch = 0; batch < 40; ++batch)
    for (const bool joined : {false, true}) {
      const int n = fill_rays(p.nested, 100 + batch, rays.get(), joined);
      RGB a[RayBatch::capacity], b[RayBatch::capacity];
      p.nested.transmitted(*rays, n, a);
      p.flat.transmitted(*rays, n, b);
      for (int i = 0; i < n; ++i) a[i].r == b[i].r ? ++(a[i].r > 0 ? lit : dark) : ++other;
    }
  EXPECT_GT(lit, 1000);
  EXPECT_GT(dark, 1000);
  EXPECT_LE(other, 4);
}

// Cut-outs know the hit's parameters and how wide a ray is in the object's space.
TEST(Portals, CutOutWhatFlatGeometryCutsOut) {
  const Halves halves_of_nested, halves_of_flat;
  Pair p(CutOut::gray);
  p.nested.set_opacity_test(&halves_of_nested), p.flat.set_opacity_test(&halves_of_flat);
  const Comparison found = compare(p, false);
  EXPECT_GT(found.on_paths, 1000);
  EXPECT_LE(found.other, 4);
  const auto rays = std::make_unique<RayBatch>();
  const auto hits = std::make_unique<HitBatch>();
  // A ray down on one triangle of scale 8 through two levels of scale 4 and 2.
  TracedScene nested;
  nested.set_opacity_test(&halves_of_nested);
  const uint32_t inner = nested.add_object(), outer = nested.add_object();
  auto mesh = std::make_shared<geom::Mesh>();
  mesh->P = {{-1, -1, 0}, {3, -1, 0}, {-1, 3, 0}};
  mesh->indices = {0, 1, 2};
  const uint32_t g = nested.add(MeshPtr(mesh), CutOut::gray, inner);
  PlacementSet two, four;
  const float by_two[3][4] = {{2, 0, 0, 0}, {0, 2, 0, 0}, {0, 0, 2, 0}},
              by_four[3][4] = {{4, 0, 0, 0}, {0, 4, 0, 0}, {0, 0, 4, 0}};
  two.add(by_two), four.add(by_four);
  nested.add_placements(inner, std::move(two), outer);
  nested.add_placements(outer, std::move(four));
  nested.commit();
  rays->set(0, V3f(6, -4, 10), V3f(0, 0, -1), infinity, 0, 1, 0.5f, 0.03f);
  nested.intersect(*rays, 1, hits.get());
  ASSERT_EQ(hits->geometry[0], g);
  EXPECT_FLOAT_EQ(halves_of_nested.widths.at(g), (0.5f + 0.03f * 10) / 8);
}

// What begins on a surface of a path does not meet it again.
TEST(Portals, LetRaysLeaveSurfaces) {
  TracedScene scene;
  const uint32_t inner = scene.add_object(), middle = scene.add_object(), outer = scene.add_object();
  scene.add(ball(0.5f), CutOut::none, inner);
  KeyedRng rng(8);
  PlacementSet a, b, c;
  for (int i = 0; i < 3; ++i)
    add(random_map(rng, 2, 0.7), &a), add(random_map(rng, 5, 1), &b), add(random_map(rng, 2000, 1), &c);
  scene.add_placements(inner, std::move(a), middle);
  scene.add_placements(middle, std::move(b), outer);
  scene.add_placements(outer, std::move(c));
  scene.commit();
  const auto rays = std::make_unique<RayBatch>();
  const auto hits = std::make_unique<HitBatch>();
  const auto next = std::make_unique<HitBatch>();
  int met = 0, others = 0;
  for (int batch = 0; batch < 20; ++batch) {
    std::vector<uint32_t> from;
    for (int i = 0; i < RayBatch::capacity; ++i) {
      const uint32_t path = uint32_t(rng.next() * float(scene.instance_count()));
      const V3f centre = scene.instance_point(path, V3f(0, 0, 0));
      const V3f d = normalize(V3f(rng.next() - 0.5f, rng.next() - 0.5f, rng.next() - 0.5f));
      rays->set(i, centre + d * 3, -d, infinity, 0, uint32_t(i));
    }
    scene.intersect(*rays, RayBatch::capacity, hits.get());
    int n = 0;
    const auto on = std::make_unique<RayBatch>();
    for (int i = 0; i < RayBatch::capacity; ++i) {
      if (hits->geometry[i] == no_id) continue;
      const auto s = scene.surface(*hits, i, 0);
      // The convex ball's outer side: no ray from it meets that ball again.
      const V3f out = dot(s.Ng, rays->direction(i)) < 0 ? s.Ng : -s.Ng;
      on->set(n++, s.P + out * s.error, out, 0.05f, 0, uint32_t(i));
      from.push_back(hits->instance[i]);
    }
    met += n;
    scene.intersect(*on, n, next.get());
    for (int i = 0; i < n; ++i) {
      if (next->geometry[i] == no_id) continue;
      EXPECT_NE(next->instance[i], from[size_t(i)]);
      ++others;
    }
  }
  EXPECT_GT(met, 1000);
  EXPECT_LT(others, met / 4);  // most were not stopped by another before they could show it
}

TEST(Portals, KeepToThePartsOfAScene) {
  TracedScene scene;
  const uint32_t a = scene.add_object();
  scene.add(ball(1), CutOut::none, a);
  const Transform at = Transform::translate(V3d(10, 0, 0));
  scene.add_instance(a, AnimatedTransform(at, at));
  PlacementSet set;
  const float rows[3][4] = {{1, 0, 0, 20}, {0, 1, 0, 0}, {0, 0, 1, 0}};
  set.add(rows);
  scene.add_placements(a, std::move(set));
  scene.commit();
  EXPECT_EQ(scene.single_count(), 1u);
  EXPECT_EQ(scene.instance_count(), 2u);
  const auto part = scene.make_part({0});
  const auto rays = std::make_unique<RayBatch>();
  const auto hits = std::make_unique<HitBatch>();
  rays->set(0, V3f(0, 0, 0), V3f(1, 0, 0), infinity, 0, 1);
  scene.intersect(*rays, 1, hits.get());
  EXPECT_EQ(hits->instance[0], 0u);
  EXPECT_FLOAT_EQ(hits->t[0], 9);
  scene.intersect(*part, *rays, 1, hits.get());
  EXPECT_EQ(hits->instance[0], 1u);
  EXPECT_FLOAT_EQ(hits->t[0], 19);
}

TEST(Portals, RefuseWhatTheyCannotName) {
  TracedScene scene;
  std::vector<uint32_t> objects;
  const float unit[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
  for (int level = 0; level < 5; ++level) objects.push_back(scene.add_object());
  scene.add(ball(1), CutOut::none, objects[0]);
  for (size_t level = 0; level < 4; ++level) {
    PlacementSet set;
    set.add(unit);
    scene.add_placements(objects[level], std::move(set), objects[level + 1]);
  }
  PlacementSet set;
  set.add(unit);
  EXPECT_THROW(scene.add_placements(objects[4], set), Error);
  const float flat[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 0, 0}};
  EXPECT_EQ(scene.reach_of_placement(objects[0], flat), 0);
  EXPECT_GT(scene.reach_of_placement(objects[0], unit), 1e17f);
  // 300^4 paths: more than 32 bits.
  TracedScene large;
  std::vector<uint32_t> nested{large.add_object()};
  large.add(ball(1), CutOut::none, nested[0]);
  const auto place = [&](uint32_t owner) {
    PlacementSet many;
    for (int i = 0; i < 300; ++i) {
      const float m[3][4] = {{1, 0, 0, float(i)}, {0, 1, 0, 0}, {0, 0, 1, 0}};
      many.add(m);
    }
    large.add_placements(nested.back(), std::move(many), owner);
    nested.push_back(owner);
  };
  for (int level = 0; level < 3; ++level) place(large.add_object());
  EXPECT_THROW(place(no_id), Error);
}

// Sorting moves placements and loses none; one that stands there twice is left out, whatever stands around it.
TEST(PlacementSets, KeepWhatIsAdded) {
  KeyedRng rng(3);
  PlacementSet set;
  std::multimap<float, int> expected;
  for (int i = 0; i < 1001; ++i) {
    float m[3][4];
    for (auto& row : m)
      for (float& x : row) x = rng.next();
    m[0][0] = float(i);
    expected.emplace(m[0][0] + m[1][3] + m[2][1], i);
    set.add(m);
    if (i % 7 == 0) set.add(m);
  }
  EXPECT_EQ(set.arrange(), 143u);
  ASSERT_EQ(set.size(), 1001u);
  for (uint32_t i = 0; i < set.size(); ++i) {
    float m[3][4];
    set.rows(i, m);
    const auto found = expected.find(m[0][0] + m[1][3] + m[2][1]);
    ASSERT_NE(found, expected.end());
    EXPECT_EQ(float(found->second), m[0][0]);
    expected.erase(found);
  }
  // Two that are turned otherwise in one place, in turns: each once.
  PlacementSet pairs;
  for (int i = 0; i < 100; ++i) {
    const float sign = i % 2 == 0 ? 1.0f : -1.0f, turned[3][4] = {{sign, 0, 0, 5}, {0, sign, 0, 5}, {0, 0, 1, 5}};
    pairs.add(turned);
  }
  EXPECT_EQ(pairs.arrange(), 98u);
  EXPECT_EQ(pairs.size(), 2u);
  // A million in one place.
  PlacementSet heap;
  const float m[3][4] = {{1, 0, 0, 1}, {0, 1, 0, 2}, {0, 0, 1, 3}};
  for (int i = 0; i < 1000000; ++i) heap.add(m);
  EXPECT_EQ(heap.arrange(), 999999u);
}

}  // namespace
}  // namespace dapple::trace
