// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/open_origins.h"
#include "dapple/distribution/point_placer.h"
#include "dapple/distribution/point_shader.h"

namespace dapple::distribution {

/// Which rays of a set.
using RayFilter = bool (*)(const integrate::RaySet&, int ray);

/// Ends rays in the radiosity cache (Christensen et al. 2012): chooses the tile and its resolution by what the ray
/// stands for, looks entries up in batches, and has a PointShader fill what is missing.
class CachedRadiosity {
 public:
  /// Diffuse rays end in `radiosity`, and probes of subsurface bodies in `irradiance`, unless they are null. None
  /// serves viewers: what they see in mirrors is sharp.
  CachedRadiosity(const ShadingScene& shading, const PointPlacer& placer, const PointShader& shader,
                  gi::RadiosityCache* radiosity, gi::RadiosityCache* irradiance);

  bool serves(Arrival arrival) const { return cache(arrival) != nullptr; }

  /// Rays read cells that are wider than the point that sends them by this, times ShadingSettings::cache_width.
  /// `share`: of points that share the rays of one (PointBatch::diffuse_share).
  float growth(const Place& place, int share = 1) const;

  /// Width of what ray i of a set from the batch reads, in m, at so much of the footprint
  /// (ShadingSettings::cache_width).
  float width_read(const integrate::PointBatch& b, const integrate::RaySet& r, int i, float growth,
                   float cache_width) const {
    return std::min(b.width[r.point[i]] * (1 + growth * cache_width) + r.cone[i] * r.distance[i] * cache_width,
                    widest_cell_);
  }

  /// Of a ray of this set that may be answered: the cell that it would read, whoever else does; of no area where there
  /// is none.
  ReadCell cell_read(const integrate::PointBatch& b, const Place& below, const integrate::RaySet& r, int i,
                     float growth, ShadingWorkspace& w) const;

  /// Finds the tile that serves each of these rays, if one does, and groups them by it: w.cache_level(place.level). Its
  /// resolution follows from the width of the point that sent the ray, grown so, and the ray's cone.
  void locate(const Place& place, const Place& below, float growth, RayFilter wanted, int sets,
              ShadingWorkspace& w) const;
  /// Adds to L of these rays what the cache of below.arrival says, where it serves them: RaySet::cached. It must be
  /// there.
  void add(const Place& place, const Place& below, float growth, RayFilter wanted, int sets, ShadingWorkspace& w) const;

 private:
  gi::RadiosityCache* cache(Arrival arrival) const {
    return arrival == Arrival::probe ? irradiance_ : arrival == Arrival::diffuse ? radiosity_ : nullptr;
  }
  static gi::RadiosityCache::Counts& counts(Arrival arrival, ShadingWorkspace& w) {
    return arrival == Arrival::probe ? w.irradiance_caches : w.caches;
  }
  float group_width() const;
  bool lies_near_light(const scene::GridId& tile, ShadingWorkspace& w) const;
  bool dice_hit(const integrate::PointBatch& b, const Place& below, const integrate::RaySet& r, int i, float growth,
                scene::PatchTable::PatchHit* hit, float* width, scene::GridPoint* at, ShadingWorkspace& w) const;
  bool is_read_enough(const Place& below, const integrate::RaySet& r, int i, const scene::GridId& tile,
                      ShadingWorkspace& w) const;
  int entry_at(const Place& below, const integrate::RaySet& r, int i, const scene::PatchTable::PatchHit& hit,
               float width, scene::GridPoint* at, gi::CacheBatch& c, ShadingWorkspace& w) const;
  void find_or_fill(const Place& below, gi::CacheBatch& c, ShadingWorkspace& w) const;
  void fill(const Place& below, int begin, int end, gi::CacheBatch& c, ShadingWorkspace& w) const;
  void link_tiles(int begin, int end, gi::CacheBatch& c, ShadingWorkspace& w) const;
  void fill_batch(const Place& below, gi::CacheBatch& c, ShadingWorkspace& w) const;
  static void count_uses(const Place& below, const gi::CacheBatch& c, ShadingWorkspace& w);

  const ShadingScene& shading_;
  const PointPlacer& placer_;
  const PointShader& shader_;
  const OpenOrigins open_origins_;
  gi::RadiosityCache *const radiosity_, *const irradiance_;
  const float widest_cell_;
};

}  // namespace dapple::distribution
