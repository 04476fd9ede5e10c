// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/custom_stages.h"

namespace dapple::distribution {

using integrate::LightSums;
using integrate::PointBatch;
using shading::Stage;

namespace {

constexpr int capacity = pattern::ShadingPoints::capacity;

// The points of one material, side by side.
struct Group {
  int count = 0;
  int point[capacity];
  RGB a[capacity], b[capacity], c[capacity];
  V3f wo[capacity];
};

// Calls body(material, group) for each material of the batch that has the stage, with points and Bsdfs gathered.
template <class Body>
void for_each_group(const scene::Scene& scene, Stage stage, PointBatch& b, ShadingWorkspace& w, const Body& body) {
  const auto material_of = [&](int k) { return scene.bindings[b.geometry[k]].material; };
  const auto has = [&](int k) { return scene.materials[size_t(material_of(k))]->stages().has(stage); };
  bool done[PointBatch::capacity] = {};
  for (int first = 0; first < b.count; ++first) {
    if (done[first] || !has(first)) continue;
    Group g;
    const auto run = [&] {
      w.points.count = g.count;
      const Timer timer;
      body(*scene.materials[size_t(material_of(first))], g);
      w.stages.shading_seconds += timer.seconds();
      g.count = 0;
    };
    for (int k = first; k < b.count; ++k) {
      if (material_of(k) != material_of(first)) continue;
      done[k] = true;
      w.prelighting.bsdf[g.count] = b.bsdf[k];
      b.describe(k, &w.points, g.count);
      g.point[g.count++] = k;
      if (g.count == capacity) run();
    }
    if (g.count > 0) run();
  }
}

void gather(const Group& g, const LightSums& from, RGB* to) {
  for (int i = 0; i < g.count; ++i) to[i] = from[g.point[i]];
}
void scatter(const Group& g, const RGB* from, LightSums& to) {
  for (int i = 0; i < g.count; ++i) to.change(g.point[i], from[i]);
}

}  // namespace

void run_diffuselighting(const scene::Scene& scene, PointBatch& b, ShadingWorkspace& w) {
  for_each_group(scene, Stage::diffuselighting, b, w, [&](const shading::Material& material, Group& g) {
    gather(g, b.irradiance, g.a);
    gather(g, b.irradiance_behind, g.b);
    gather(g, b.diffuse, g.c);
    material.diffuselighting({w.points, w.prelighting.bsdf, g.a, g.b, g.c});
    scatter(g, g.c, b.diffuse);
  });
}

void run_view_stages(const scene::Scene& scene, PointBatch& b, ShadingWorkspace& w) {
  for_each_group(scene, Stage::specularlighting, b, w, [&](const shading::Material& material, Group& g) {
    gather(g, b.diffuse, g.a);
    gather(g, b.specular, g.b);
    for (int i = 0; i < g.count; ++i) g.wo[i] = b.wo[g.point[i]];
    material.specularlighting({w.points, w.prelighting.bsdf, g.wo, g.a, g.b, g.c});
    scatter(g, g.c, b.Ci);
  });
  for_each_group(scene, Stage::postlighting, b, w, [&](const shading::Material& material, Group& g) {
    gather(g, b.Ci, g.a);
    for (int i = 0; i < g.count; ++i) g.wo[i] = b.wo[g.point[i]];
    material.postlighting({w.points, w.prelighting.bsdf, g.wo, g.a});
    scatter(g, g.a, b.Ci);
    w.stages[Stage::postlighting] += uint64_t(g.count);
  });
}

}  // namespace dapple::distribution
