// SPDX-License-Identifier: Apache-2.0
#include "dapple/distribution/custom_stages.h"

#include <span>
#include <utility>

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

// What stages see is light by the gains of its groups. What goes on from them is light of gains 1 again, which the film
// will weight: its parts by group are shares of what the stage gave, divided by their gains.
class Gains {
 public:
  Gains(const scene::Scene& scene, const LightSums& any) {
    if (scene.light_groups.has_gains() && !any.parts(0).empty()) gains_ = scene.light_groups.gains;
  }

  void gather(const Group& g, const LightSums& from, RGB* to) const {
    for (int i = 0; i < g.count; ++i) to[i] = seen(from, g.point[i]);
  }
  void scatter(const Group& g, const RGB* from, LightSums& to) const {
    for (int i = 0; i < g.count; ++i) {
      if (gains_.empty())
        to.change(g.point[i], from[i]);
      else
        change(from[i], to, g.point[i]);
    }
  }

 private:
  RGB seen(const LightSums& sums, int k) const {
    if (gains_.empty()) return sums[k];
    RGB sum;
    for (size_t group = 0; group < gains_.size(); ++group) sum += gains_[group] * sums.parts(k)[group];
    return sum;
  }

  // Light of no group falls to the first that shows.
  void change(const RGB& given, LightSums& sums, int k) const {
    const RGB before = seen(sums, k);
    RGB parts[scene::LightGroups::max_count], sum;
    for (int c = 0; c < 3; ++c) {
      const float scale = given[c] / before[c];
      const bool shared = before[c] > 0 && scale < infinity;
      bool left = !shared;
      for (size_t group = 0; group < gains_.size(); ++group) {
        const float gain = gains_[group][c];
        if (gain == 0) continue;
        if (shared) parts[group][c] = sums.parts(k)[group][c] * scale;
        if (std::exchange(left, false)) parts[group][c] = given[c] / gain;
        sum[c] += parts[group][c];
      }
    }
    sums.set(k, {sum, parts});
  }

  std::span<const RGB> gains_;  // none: all 1
};

}  // namespace

void run_diffuselighting(const scene::Scene& scene, PointBatch& b, ShadingWorkspace& w) {
  const Gains gains(scene, b.diffuse);
  for_each_group(scene, Stage::diffuselighting, b, w, [&](const shading::Material& material, Group& g) {
    gains.gather(g, b.irradiance, g.a);
    gains.gather(g, b.irradiance_behind, g.b);
    gains.gather(g, b.diffuse, g.c);
    material.diffuselighting({w.points, w.prelighting.bsdf, g.a, g.b, g.c});
    gains.scatter(g, g.c, b.diffuse);
  });
}

void run_view_stages(const scene::Scene& scene, PointBatch& b, ShadingWorkspace& w) {
  const Gains gains(scene, b.Ci);
  for_each_group(scene, Stage::specularlighting, b, w, [&](const shading::Material& material, Group& g) {
    gains.gather(g, b.diffuse, g.a);
    gains.gather(g, b.specular, g.b);
    for (int i = 0; i < g.count; ++i) g.wo[i] = b.wo[g.point[i]];
    material.specularlighting({w.points, w.prelighting.bsdf, g.wo, g.a, g.b, g.c});
    gains.scatter(g, g.c, b.Ci);
  });
  for_each_group(scene, Stage::postlighting, b, w, [&](const shading::Material& material, Group& g) {
    gains.gather(g, b.Ci, g.a);
    for (int i = 0; i < g.count; ++i) g.wo[i] = b.wo[g.point[i]];
    material.postlighting({w.points, w.prelighting.bsdf, g.wo, g.a});
    gains.scatter(g, g.a, b.Ci);
    w.stages[Stage::postlighting] += uint64_t(g.count);
  });
}

}  // namespace dapple::distribution
