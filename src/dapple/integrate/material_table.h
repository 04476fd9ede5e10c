// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "dapple/base/timer.h"
#include "dapple/integrate/integrator.h"

namespace dapple::integrate {

/// What integrators ask of the materials of a scene, and prelighting of mixed points in batches of equal material.
class MaterialTable {
 public:
  /// Caustics: light that metal and coats send on where a diffuse ray met them. Without, they count as diffuse there.
  explicit MaterialTable(const scene::Scene& scene, bool caustics = true);

  const shading::Material& material(uint32_t geometry) const { return *scene_.materials[index(geometry)]; }
  /// Prelighting reads tangents, or u and v.
  bool needs_tangents(uint32_t geometry) const { return needs_tangents_[index(geometry)]; }
  /// The surface is not there: it only separates media.
  bool passes(uint32_t geometry) const { return passes_[index(geometry)]; }
  /// shading::Material::work.
  float work(uint32_t geometry) const { return work_[index(geometry)]; }
  /// Some surface of the scene is not there, or light is weakened on its way: rays of all kinds are traced from surface
  /// to surface.
  bool rays_pass() const { return rays_pass_; }
  /// Light may go straight through it (scattering/sheet.h), which lamps do not; how much is for prelighting to say.
  bool is_sheet(uint32_t geometry) const { return any_sheet_ && sheet_[geometry]; }
  bool any_sheet() const { return any_sheet_; }
  /// Of some sheets a part is none, drawn at random.
  bool any_random_sheet() const { return random_sheet_; }
  bool lets_through(uint32_t geometry) const { return passes(geometry) || is_sheet(geometry); }
  /// Shadow rays are traced from surface to surface.
  bool shadows_pass() const { return rays_pass_ || any_sheet_; }

  /// Prelighting chooses at random.
  bool is_random(uint32_t geometry) const { return scene_.materials[index(geometry)]->is_random(); }
  /// What a diffuse ray sees of it is diffuse, or counts as such.
  bool is_flat(uint32_t geometry) const { return flat_[index(geometry)]; }
  /// Of diffuse light, what its coat, or the boundary of a subsurface body, mirrors: diffuse rays see that beside what
  /// counts as diffuse. Where it differs from place to place, some value. 0: nothing.
  float coat(uint32_t geometry) const { return coat_[index(geometry)]; }
  bool has_coat(uint32_t geometry) const { return coat(geometry) > 0; }
  bool any_coat() const {
    return std::any_of(coat_.begin(), coat_.end(), [](float coat) { return coat > 0; });
  }
  /// All that is seen of it is diffuse light, from wherever it is seen.
  bool is_view_independent(uint32_t geometry) const { return view_independent_[index(geometry)]; }
  /// Prelighting reads the points: it differs from place to place.
  bool varies(uint32_t geometry) const { return !constants_[index(geometry)]; }

  /// For whom prelighting is: all, or diffuse rays, to which layers and metal may count as diffuse.
  enum class For { viewers, diffuse_rays };

  /// Writes out[k] where prelighting does not vary, and leaves the others alone.
  void prelight_constant(int n, const uint32_t* geometry, const geom::SurfacePoint* surface, scattering::Bsdf* out,
                         For whom = For::viewers) const;

  /// What prelight() works with. About 0.1 MB.
  struct Scratch {
    static constexpr int most_points = 1024, capacity = pattern::ShadingPoints::capacity;
    pattern::ShadingPoints points;
    scattering::Bsdf bsdf[capacity];
    struct Batched {
      uint32_t material;
      int point;
    } batched[most_points];
  };

  /// Runs prelighting at n <= Scratch::most_points points: out[0, n), and counts it. set_point(k, points, lane)
  /// describes point k where a material does not scatter the same everywhere.
  template <class SetPoint>
  void prelight(int n, const uint32_t* geometry, const geom::SurfacePoint* surface, const SetPoint& set_point,
                scattering::Bsdf* out, Scratch& scratch, StageCounts* counts, For whom = For::viewers) const;

 private:
  void flatten(int n, scattering::Bsdf* bsdf) const;
  size_t index(uint32_t geometry) const { return size_t(scene_.bindings[geometry].material); }

  const scene::Scene& scene_;
  const bool caustics_;
  // By material.
  std::vector<std::optional<scattering::Bsdf>> constants_, flat_constants_;  ///< where it scatters the same everywhere
  std::vector<uint8_t> needs_tangents_, passes_, flat_, view_independent_;
  std::vector<float> coat_, work_;
  std::vector<uint8_t> sheet_;  // by geometry
  bool rays_pass_ = false, any_sheet_ = false, random_sheet_ = false;
};

template <class SetPoint>
void MaterialTable::prelight(int n, const uint32_t* geometry, const geom::SurfacePoint* surface,
                             const SetPoint& set_point, scattering::Bsdf* out, Scratch& scratch, StageCounts* counts,
                             For whom) const {
  const Timer timer;
  prelight_constant(n, geometry, surface, out, whom);
  int batched = 0;
  for (int k = 0; k < n; ++k)
    if (varies(geometry[k])) scratch.batched[batched++] = {uint32_t(index(geometry[k])), k};
  std::stable_sort(scratch.batched, scratch.batched + batched,
                   [](const auto& a, const auto& b) { return a.material < b.material; });
  for (int first = 0; first < batched;) {
    const uint32_t m = scratch.batched[first].material;
    int count = 0;
    for (; count < Scratch::capacity && first + count < batched && scratch.batched[first + count].material == m;
         ++count)
      set_point(scratch.batched[first + count].point, &scratch.points, count);
    scratch.points.count = count;
    const shading::Material& material = *scene_.materials[m];
    if (whom == For::diffuse_rays && flat_[m]) {
      material.flat_prelighting(scratch.points, scratch.bsdf);
    } else {
      material.prelighting(scratch.points, scratch.bsdf);
      if (whom == For::diffuse_rays) flatten(count, scratch.bsdf);
    }
    for (int i = 0; i < count; ++i) {
      const int k = scratch.batched[first + i].point;
      out[k] = scratch.bsdf[i];
      out[k].set_geometric_normal(surface[k].Ng);
    }
    first += count;
    ++counts->batches;
  }
  (*counts)[shading::Stage::prelighting] += uint64_t(n);
  counts->shading_seconds += timer.seconds();
}

}  // namespace dapple::integrate
