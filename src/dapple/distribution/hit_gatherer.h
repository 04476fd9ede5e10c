// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/cached_radiosity.h"
#include "dapple/distribution/diffuse_rays.h"

namespace dapple::distribution {

/// From rays to hits to answers: what leaves the surfaces that rays met comes from the radiosity cache where that
/// serves them, else from shading them.
class HitGatherer {
 public:
  HitGatherer(const ShadingScene& shading, const CachedRadiosity& cached, const PointShader& shader)
      : shading_(shading), cached_(cached), shader_(shader) {}

  static bool any_ray(const integrate::RaySet&, int) { return true; }

  /// Traces the first so many sets of diffuse rays of the batch: their hits, distances, and L, weighted, of what they
  /// meet. The more at a time, the fuller are the batches in which shaders run for what the cache lacks.
  void gather(const Place& place, int sets, ShadingWorkspace& w) const;
  /// The same of lights that they meet alone.
  void look(const Place& place, int sets, ShadingWorkspace& w) const;

  /// Adds to L of these rays of the first sets what leaves the surfaces that they met: from the nearest point in the
  /// cache of below.arrival where there is one that serves them (`growth`: CachedRadiosity::locate), else by shading
  /// them at `below`. And what scatters into them where they ended in media.
  void answer(const Place& place, const Place& below, float growth, RayFilter wanted, int sets,
              ShadingWorkspace& w) const;

 private:
  /// alone: without the glow of media that are no lights.
  void find_lights(const Place& place, bool alone, int sets, ShadingWorkspace& w) const;
  /// Of a ray that goes on as one, and fills no cell: its hit keeps its coat.
  bool keeps_layers(const Place& below, const integrate::RaySet& r, int ray) const;
  template <class Weight>
  void shade_hits(const Place& place, const Place& below, int sets, const Weight& weight, ShadingWorkspace& w) const;
  void set_hit(const integrate::PointBatch& b, const integrate::RaySet& r, int i, float taken, bool coat,
               integrate::PointBatch& found, int c) const;
  void add_coats(const Place& place, const Place& below, RayFilter wanted, int sets, ShadingWorkspace& w) const;
  float coat_weight(const integrate::PointBatch& b, const integrate::RaySet& r, int ray) const;
  void add_media(integrate::RaySet& r, const Place& below, RayFilter wanted, ShadingWorkspace& w) const;

  const ShadingScene& shading_;
  const CachedRadiosity& cached_;
  const PointShader& shader_;
};

}  // namespace dapple::distribution
