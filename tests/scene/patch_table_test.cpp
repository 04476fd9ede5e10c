// SPDX-License-Identifier: Apache-2.0
#include "dapple/scene/patch_table.h"

#include <gtest/gtest.h>

#include "dapple/base/hash.h"
#include "dapple/numeric/warp.h"

namespace dapple::scene {
namespace {

V3f random_vector(KeyedRng& rng) {
  const float x = rng.next(), y = rng.next(), z = rng.next();
  return {2 * x - 1, 2 * y - 1, 2 * z - 1};
}

// Folded quads, as faces or as pairs of triangles; every third of the latter lacks its second triangle.
std::shared_ptr<geom::Mesh> folded_quads(int corners, uint64_t key) {
  auto mesh = std::make_shared<geom::Mesh>();
  mesh->corners = corners;
  KeyedRng rng(key);
  for (uint32_t q = 0; q < 20; ++q) {
    const V3f p = random_vector(rng) * 5.0f, e1 = random_vector(rng) * 2.0f, e2 = cross(e1, random_vector(rng));
    for (const V3f& corner : {p, p + e1, p + e1 + e2, p + e2})
      mesh->P.push_back(corner + random_vector(rng) * 0.03f * length(e2));
    const uint32_t quad[] = {4 * q, 4 * q + 1, 4 * q + 2, 4 * q + 3},
                   triangles[] = {4 * q, 4 * q + 1, 4 * q + 2, 4 * q, 4 * q + 2, 4 * q + 3};
    if (corners == 4)
      mesh->indices.insert(mesh->indices.end(), quad, quad + 4);
    else
      mesh->indices.insert(mesh->indices.end(), triangles, triangles + (q % 3 == 0 ? 3 : 6));
  }
  return mesh;
}

// Eight meshes as they are, then eight in instances that stand still, and eight in those that move: each plain,
// flipped, with normals, and deforming, of triangles and of quads.
void add_all_kinds(trace::TracedScene& scene) {
  const Transform place =
      Transform::translate({3, 1, 2}) * Transform::rotate(50, {1, 2, 3}) * Transform::scale({2, 1, -0.5f});
  const AnimatedTransform still(place, place);
  const AnimatedTransform moving(Transform(), Transform::translate({1, -1, 2}) * Transform::rotate(40, {1, 1, 0}));
  for (const AnimatedTransform* motion : {static_cast<const AnimatedTransform*>(nullptr), &still, &moving})
    for (const int corners : {3, 4})
      for (const char* kind : {"plain", "flipped", "smooth", "deforming"}) {
        auto mesh = folded_quads(corners, hash(corners, kind[0]));
        mesh->flip = kind[0] == 'f';
        KeyedRng rng(7);
        if (kind[0] == 's')
          for (size_t i = 0; i < mesh->P.size(); ++i) mesh->N.push_back(normalize(random_vector(rng)));
        if (kind[0] == 'd')
          for (const V3f& p : mesh->P) mesh->P_end.push_back(p + random_vector(rng));
        const uint32_t object = motion ? scene.add_object() : trace::no_id;
        scene.add(mesh, trace::CutOut::none, object);
        if (motion) scene.add_instance(object, *motion);
      }
  scene.commit();
}

uint32_t instance_of(uint32_t geometry) {
  return geometry < 8 ? trace::no_id : geometry - 8;
}

// Places on tiles are where their hits are: of all kinds of patches, those that are taken for two triangles, and those
// that are not.
TEST(PatchTable, SurfaceOnATileIsThatOfTheHitThere) {
  trace::TracedScene scene;
  add_all_kinds(scene);
  const PatchTable patches(scene);
  PatchTable::Extents memory;
  int checked = 0;
  for (uint32_t g = 0; g < scene.geometry_count(); ++g) {
    const uint32_t instance = instance_of(g);
    const auto& mesh = *std::get<trace::MeshPtr>(scene.shape(g));
    const geom::PatchMap map(mesh);
    for (int n = 0; n < 2000; ++n) {
      KeyedRng rng(hash(g, n));
      GridId id;
      id.instance = instance, id.geometry = g;
      id.patch = std::min(uint32_t(rng.next() * float(map.patch_count())), map.patch_count() - 1);
      id.u_level = uint8_t(rng.next() * 6), id.v_level = uint8_t(rng.next() * 6);
      id.tile_u = uint32_t(rng.next() * float((1 << id.u_level) / id.width())),
      id.tile_v = uint32_t(rng.next() * float((1 << id.v_level) / id.height()));
      const float x = rng.next() * float(id.width()), y = rng.next() * float(id.height()), time = rng.next();
      const geom::SurfacePoint found = patches.surface_on_tile(id, x, y, time, &memory);
      trace::HitBatch hit;
      patches.place_on_tile(id, x, y, &hit, 0);
      const geom::SurfacePoint expected = scene.surface(hit, 0, time, false);
      ASSERT_LE(length(found.P - expected.P), found.error + expected.error) << g << " " << n;
      ASSERT_LE(found.error, 1e-4f);
      // Beside the edge where the triangles meet, either normal will do.
      const auto at = map.patch_point(hit.primitive[0], hit.u[0], hit.v[0]);
      if (std::abs(at.s - at.t) < 1e-3f || std::abs(at.s + at.t - 1) < 1e-3f) continue;
      ++checked;
      ASSERT_LT(length(found.Ng - expected.Ng), 1e-5f) << g << " " << n;
      ASSERT_LT(length(found.Ns - expected.Ns), 1e-5f) << g << " " << n;
    }
  }
  EXPECT_GT(checked, 40000);
}

// A hit on a patch that is taken for two triangles is found without its surface, and half the width without dicing
// anew.
TEST(PatchTable, ShortWaysGiveTheSamePlaces) {
  trace::TracedScene scene;
  add_all_kinds(scene);
  const PatchTable patches(scene);
  PatchTable::Extents memory;
  int flat = 0, refined = 0;
  for (uint32_t g = 0; g < scene.geometry_count(); ++g) {
    const auto& mesh = *std::get<trace::MeshPtr>(scene.shape(g));
    for (int n = 0; n < 2000; ++n) {
      KeyedRng rng(hash(g, n));
      trace::HitBatch hits;
      hits.instance[0] = instance_of(g), hits.geometry[0] = g;
      hits.primitive[0] = std::min(uint32_t(rng.next() * float(mesh.face_count())), uint32_t(mesh.face_count()) - 1);
      hits.u[0] = rng.next(), hits.v[0] = rng.next();
      if (mesh.corners == 3 && hits.u[0] + hits.v[0] > 1) hits.u[0] = 1 - hits.u[0], hits.v[0] = 1 - hits.v[0];
      const float time = rng.next();
      const V3f d = normalize(random_vector(rng));
      const geom::SurfacePoint surface = scene.surface(hits, 0, time, false);
      const PatchTable::PatchHit hit = patches.patch_hit(hits, 0, d, time, surface, &memory);
      PatchTable::PatchHit quick;
      const bool is_flat = patches.flat_patch_hit(hits, 0, d, time, &memory, &quick);
      EXPECT_EQ(is_flat, g < 16 && mesh.N.empty() && mesh.P_end.empty());
      if (is_flat) {
        ++flat;
        EXPECT_EQ(quick.patch, hit.patch);
        EXPECT_EQ(quick.half, hit.half);
        EXPECT_EQ(quick.s, hit.s);
        EXPECT_EQ(quick.t, hit.t);
        EXPECT_FLOAT_EQ(quick.s_length2, hit.s_length2);
        EXPECT_FLOAT_EQ(quick.t_length2, hit.t_length2);
        EXPECT_LT(length(quick.Ng - surface.Ng), 1e-4f);
        EXPECT_TRUE(quick.behind == hit.behind || std::abs(dot(surface.Ng, d)) < 1e-3f);
      }
      GridPoint coarse, fine;
      float width = 3;
      ASSERT_TRUE(patches.dice(hit, width, &coarse));
      for (int halvings = 0; halvings < 8; ++halvings) {
        patches.refine(hit, width *= 0.5f, &coarse);
        ASSERT_TRUE(patches.dice(hit, width, &fine));
        EXPECT_EQ(coarse.grid, fine.grid);
        EXPECT_EQ(coarse.x, fine.x);
        EXPECT_EQ(coarse.y, fine.y);
        refined += fine.grid.u_level > 1 && fine.grid.v_level > 1;
      }
    }
  }
  EXPECT_GT(flat, 10000);
  EXPECT_GT(refined, 100000);
}

}  // namespace
}  // namespace dapple::scene
