// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "dapple/distribution/grid_numbers.h"
#include "dapple/distribution/reader_map.h"
#include "dapple/distribution/shading_place.h"
#include "dapple/distribution/shading_workspace.h"
#include "dapple/light/direct_light.h"
#include "dapple/light/shaft_light.h"

namespace dapple::distribution {

/// How many rays shading sends, and how coarse what they read may be.
struct ShadingSettings {
  int bounces = 4;                                     ///< diffuse bounces of indirect light; 0 = direct light only
  int specular_depth = 16;                             ///< glossy and mirror scatterings
  integrate::RayList shadow_rays{4}, diffuse_rays{4};  ///< a shading point, by diffuse depth; shadow rays also a light
  int subsurface_rays = 16;                            ///< probes of the body around a point that is seen
  float cache_width = 0.35f;                           ///< scale of the footprint that chooses the cache's resolution
  /// Light that metal and coats mirror where a diffuse ray met them; else it counts as diffuse there.
  bool caustics = true;
  uint64_t seed = 0;
  /// Masks in place of shadow rays; null: none. Must outlive what shades.
  const emitters::Visibility* visibility = nullptr;
  std::shared_ptr<const emitters::LearnedLights> learned_lights;  ///< null: none
  /// Light that media scatter from suns and lamps straight into camera rays; null: rays find it.
  std::shared_ptr<const light::ShaftLight> shafts;

  int diffuse_ray_count(const Place& place, int share) const { return diffuse_rays.at(place.list_depth(), share); }
  int diffuse_ray_count(const Place& place, const integrate::PointBatch& b, int k) const {
    return diffuse_rays.at(place.list_depth(), b.diffuse_share(k), b.effort[k]);
  }
};

/// A scene as shading by distribution ray tracing reads it: what all its parts share. Its functions count rays and time
/// in the workspace.
class ShadingScene {
 public:
  /// `patches`: null where nothing is diced. Both must outlive this object.
  ShadingScene(const scene::Scene& scene, const ShadingSettings& settings, const scene::PatchTable* patches);
  ShadingScene(const ShadingScene&) = delete;

  const scene::Scene& scene;
  const scene::PatchTable* const patches;
  const ShadingSettings settings;
  const integrate::MaterialTable materials;
  const integrate::RayTracer tracer;
  const light::DirectLight direct;
  const light::SurfaceMedia surface_media;
  /// Of a common cell, m2: a thousandth of the surface of the box around the middle nine tenths of the scene
  /// (trace::bulk_bounds). A power of two, which stays when
  /// things move a little; infinite in a scene without extent.
  const float common_area;

  /// Prelighting is cheap beside the rays of a point, and no light is diffused inside.
  bool is_cheap(uint32_t geometry) const {
    const shading::Material& m = materials.material(geometry);
    return materials.work(geometry) <= GridNumbers::cheap_work && !m.has_subsurface();
  }

  /// How often what is cached will be read; of diffuse depths beyond its own that is not known, and taken for often.
  std::shared_ptr<const ReaderMap> readers = std::make_shared<const ReaderMap>();
  ReadCell read_cell(const scene::GridId& tile, scene::PatchTable::Extents* memory) const;
  /// Rays that may read one cell: where there are more, they get narrower ones.
  float most_readers(int depth) const;
  /// PointBatch::effort of a cell around a place, of a diffuse depth of `readers`; 0: so few rays would read it that
  /// each had better go on by a ray of its own.
  int cell_effort(const ReaderMap::Reader& at, int depth, const ReadCell& cell) const;

  /// Diffuse rays see in coats what these mirror; with caustics off a diffuse surface.
  bool coats_mirror(const Place& below) const { return settings.caustics && below.arrival == Arrival::diffuse; }

  /// Finds the nearest hits of a set of rays, what media on the way glow, and where rays ended in these; weights lose
  /// what is lost on the way.
  void trace(integrate::RaySet& r, ShadingWorkspace& w) const;
  /// Finds the links of the tiles that are w.linking.jobs.
  void link(ShadingWorkspace& w) const;
  /// Says in which medium shading points lie whose surfaces do not.
  void find_media(integrate::PointBatch& b, ShadingWorkspace& w) const;

 private:
  const gi::TileLinker linker_;
};

/// Writes the inputs of point k of a batch: where flight f of these rays scattered in a medium. b.parent[k] is its ray.
void set_flight(const integrate::RayTracer::Flights& flights, int f, const trace::RayBatch& rays, int share,
                integrate::PointBatch& b, int k);

/// Where ray i of a set ended: as one that may read the cache.
inline ReaderMap::Reader reader_of(const integrate::RaySet& r, int i) {
  const V3f d = r.rays.direction(i), n(r.hits.nx[i], r.hits.ny[i], r.hits.nz[i]);
  return {r.rays.origin(i) + d * r.hits.t[i], dot(n, d) > 0 ? -n : n};
}

/// PointBatch::share of what one of `rays` from a point of this share meets.
inline int shared_by(int share, int rays) {
  constexpr int64_t most_shares = 1 << 16;  // more than any list of rays has
  return int(std::min(int64_t(share) * rays, most_shares));
}

/// The spread of a ray that does the work of so many: each stands for more.
inline float widened(float spread, float rays) {
  return std::max(spread, std::min(GridNumbers::widest_spread, spread * std::sqrt(rays)));
}

}  // namespace dapple::distribution
