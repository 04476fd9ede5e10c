// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/shading_workspace.h"
#include "dapple/gi/cache_answers.h"
#include "dapple/light/direct_light.h"
#include "dapple/light/surface_media.h"

namespace dapple::distribution {

/// Runs the stages of surface shaders on batches of points by distribution ray tracing (Cook et al. 1984): shadow rays
/// to the lights, diffuse rays, specular rays, and the same at what those hit. Radiance and irradiance are unbiased
/// estimates, but for what `arrival` says.
///
/// Purely diffuse points take light sources by shadow rays only (DirectLight); other points combine them with specular
/// rays that meet the source.
class HitShader {
 public:
  struct Settings {
    int bounces = 4;          ///< diffuse bounces of indirect light; 0 = direct light only
    int specular_depth = 16;  ///< glossy and mirror scatterings
    integrate::RayList shadow_rays{4},
        diffuse_rays{4};        ///< a shading point, by diffuse depth; shadow rays also a light
    int subsurface_rays = 16;   ///< probes of the body around a point that is seen
    float cache_width = 0.35f;  ///< scale of the footprint that chooses the cache's resolution
    bool caustics =
        true;  ///< light that metal and coats mirror where a diffuse ray met them; else it counts as diffuse there
    uint64_t seed = 0;
    const shading::Visibility* visibility =
        nullptr;  ///< masks in place of shadow rays; null: none. Must outlive this object
  };

  /// How a ray came to the points of a batch. Where it left a diffuse surface, or was scattered by a medium, layered
  /// materials, and metal if caustics are off, count as diffuse ones of their mean albedo, emitters are dark, since
  /// shadow rays have found them, and stages that see the viewer are not run; `coat` is for what coats mirror there, if
  /// that is not counted as diffuse. A probe only asks how much light enters a subsurface body there: `diffuse` is that
  /// / pi.
  enum class Arrival { view, diffuse, coat, probe };

  /// Where a batch stands in the recursion.
  struct Place {
    int level = 0;
    integrate::Depth depth;
    Arrival arrival = Arrival::view;
  };

  /// Diffuse rays end in `cache`, and probes of subsurface bodies in `irradiance`, unless they are null. All must
  /// outlive this object.
  HitShader(const scene::Scene& scene, const Settings& settings, const scene::PatchTable* patches,
            gi::RadiosityCache* cache, gi::RadiosityCache* irradiance = nullptr);

  const integrate::MaterialTable& materials() const { return materials_; }
  const integrate::RayTracer& tracer() const { return tracer_; }
  const light::DirectLight& direct() const { return direct_; }

  /// Runs all stages: b.Ci. Reads the inputs of the batch at place.level.
  void shade(const Place& place, ShadingWorkspace& w) const;

  /// Writes the inputs of point k of a batch: cell (i, j) of a tile. `key`: of the tile's random numbers.
  void set_shading_point(const scene::GridId& grid, int i, int j, const scene::PatchTable::Cell& cell, uint64_t key,
                         scene::PatchTable::Extents* memory, integrate::PointBatch& b, int k) const;

  /// The same, with the origins of its rays spread over the cell: pixels would show shadows' edges as steps from point
  /// to point.
  void set_seen_cell(const scene::GridId& grid, int i, int j, const scene::PatchTable::Cell& cell, uint64_t key,
                     const gi::TileLinks& links, scene::PatchTable::Extents* memory, integrate::PointBatch& b,
                     int k) const;

  /// Where such a point is at another time.
  geom::SurfacePoint surface_at(const integrate::PointBatch& b, int k, float time) const {
    return scene_.traced.surface(b.place(k), integrate::PointBatch::lane(k), time, false);
  }

  /// Finds the links of the tiles that are w.linking.jobs.
  void link(ShadingWorkspace& w) const;

  /// Says in which medium shading points lie whose surfaces do not. Part of prelight().
  void find_media(integrate::PointBatch& b, ShadingWorkspace& w) const;
  const light::SurfaceMedia& surface_media() const { return surface_media_; }

  // shade() in steps, for callers that keep what a step gives.
  void prelight(const Place& place, ShadingWorkspace& w) const;
  /// Light by the diffuse lobes: b.irradiance, b.irradiance_behind, b.diffuse. Zero where the Bsdf is not purely
  /// diffuse. Sends no diffuse rays from points of b.indirect_known.
  void light_diffuse(const Place& place, ShadingWorkspace& w) const;
  /// What so many diffuse rays from point k have in common.
  struct DiffuseFan {
    int point;
    float solid_angle;  ///< of the projected hemisphere: sr a ray
    float spread;       ///< RaySet::spread and share
    int share;
  };
  DiffuseFan diffuse_fan(const integrate::PointBatch& b, int k, int rays) const;
  /// Writes ray i of a set, of weight one: one of these along d, at an angle of this cosine with the normal.
  void set_diffuse_ray(const integrate::PointBatch& b, const DiffuseFan& fan, integrate::RaySet& r, int i,
                       const integrate::RayOrigin& from, const V3f& d, float cosine, uint32_t key) const;
  /// Traces the first so many sets of diffuse rays of the batch: their hits, distances, and L, weighted, of what they
  /// meet, from the cache if there is one. The more at a time, the fuller are the batches in which shaders run for what
  /// the cache lacks.
  void gather(const Place& place, int sets, ShadingWorkspace& w) const;
  /// Writes the inputs of point k of a batch: where flight f of these rays scattered in a medium. b.parent[k] is its
  /// ray.
  static void set_flight(const integrate::RayTracer::Flights& flights, int f, const trace::RayBatch& rays, int share,
                         integrate::PointBatch& b, int k);
  /// b.Ci of such points: the lights' and, up to the specular depth, what one ray by the phase function brings.
  void shade_media(const Place& place, ShadingWorkspace& w) const;
  /// What answers the first diffuse rays of the points of the batch, after prelight(): answers[k]. Lights nothing and
  /// changes no cache.
  void survey(const Place& place, const gi::CacheLog& log, gi::CacheAnswers* answers, ShadingWorkspace& w) const;
  /// Light by all lobes of what is not purely diffuse: b.specular.
  void light_specular(const Place& place, ShadingWorkspace& w) const;
  /// specularlighting and postlighting, for viewers: b.Ci.
  void finish(integrate::PointBatch& b, Arrival arrival, ShadingWorkspace& w) const;

 private:
  /// A ray stands for a cone of this growth at most: few rays, and those at glancing angles, would read the mean of a
  /// whole wall.
  static constexpr float widest_cone = 0.5f;
  /// Wider than this, textures would blur what shadows and edges do not.
  static constexpr float widest_spread = 0.25f;

  /// What random numbers of a point are for; 1 is DirectLight's.
  enum Purpose : uint32_t {
    for_diffuse_rays = 2,
    for_specular_rays,
    for_walks,
    for_origins,
    for_patterns,
    for_origin_times,
    for_coats
  };

  static uint32_t seed_of(uint64_t key, Purpose purpose) { return uint32_t(hash(key, uint32_t(purpose), 0)); }

  /// Which rays of a set.
  using RayFilter = bool (*)(const integrate::RaySet&, int ray);
  static bool any_ray(const integrate::RaySet&, int) { return true; }
  static bool is_diffuse_ray(const integrate::RaySet& r, int ray) { return r.lobe[ray] == shading::Lobe::diffuse; }
  static bool is_specular_ray(const integrate::RaySet& r, int ray) { return !is_diffuse_ray(r, ray); }

  static float common_area(const scene::Scene& scene);
  static float time_of_origin(const integrate::PointBatch& b, int k, int o);
  /// As set_seen_cell(), for the cache: what coarse cells hold is a mean, of patterns too, not what happens to be at
  /// their middle.
  void set_cell(const scene::GridId& grid, int i, int j, const scene::PatchTable::Cell& cell, uint64_t key,
                const gi::TileLinks& links, scene::PatchTable::Extents* memory, integrate::PointBatch& b, int k) const;
  void set_middle(const scene::GridId& grid, int i, int j, const scene::PatchTable::Cell& cell, uint64_t key,
                  scene::PatchTable::Extents* memory, integrate::PointBatch& b, int k) const;
  /// Of a group of patches, over four of them that are linked. `of_mean`: patterns are seen from one of the origins.
  void spread_origins(const scene::GridId& grid, int i, int j, const gi::TileLinks& links, bool of_mean,
                      scene::PatchTable::Extents* memory, integrate::PointBatch& b, int k) const;

  static Place behind_diffuse(const Place& place);
  /// Groups of patches are read for their mean, in which noise hides how coarse they are: forests would cost twice as
  /// much at .2.
  float group_width() const { return std::max(settings_.cache_width, std::min(1.75f * settings_.cache_width, 0.35f)); }
  /// By so many widths of the cache is what rays read wider than the point that sends them, one that `share` points do
  /// the work of (PointBatch::diffuse_share).
  float growth(const Place& place, int share = 1) const;
  /// Where the lists of rays are read: what enters a subsurface body, or is seen in fog, serves many points, as what
  /// diffuse rays meet does.
  static int list_depth(const Place& place) {
    return place.arrival == Arrival::view ? 0 : std::max(place.depth.diffuse, 1);
  }
  int diffuse_rays(const Place& place, int share) const { return settings_.diffuse_rays.at(list_depth(place), share); }
  int diffuse_rays(const Place& place, const integrate::PointBatch& b, int k) const {
    return settings_.diffuse_rays.at(list_depth(place), b.diffuse_share(k), b.effort[k]);
  }

  /// Jobs for the first `count` of so many diffuse rays of point k. flush() makes room, by draw_diffuse_rays(). Which
  /// jobs of a point stand in a batch together does not depend on other points: they are ordered, and their rays
  /// joined.
  template <class Flush>
  static void add_diffuse_jobs(const integrate::PointBatch& b, int k, int count, int rays, ShadingWorkspace& w,
                               const Flush& flush) {
    const uint32_t seed = seed_of(b.sequence[k], for_diffuse_rays);
    for (int i = 0; i < count; ++i) {
      if (i % w.capacity == 0 && w.job_count + std::min(count - i, w.capacity) > w.capacity) flush();
      const int job = w.job_count++;
      w.seed[job] = seed;
      w.index[job] = b.number[k] * uint32_t(rays) + uint32_t(i);
      w.job_weight[job] = 1 / float(rays);
      w.job_point[job] = k;
    }
  }
  void draw_diffuse_rays(const Place& place, integrate::RaySet& r, ShadingWorkspace& w) const;
  void light_indirectly(const Place& place, int sets, ShadingWorkspace& w) const;
  void draw_specular_rays(const Place& place, ShadingWorkspace& w) const;
  /// Adds to L of these rays of the first sets what is shaded where they met something, weight(set, ray) times; 0: not
  /// at all.
  template <class Weight>
  void shade_hits(const Place& place, const Place& below, int sets, const Weight& weight, ShadingWorkspace& w) const;
  /// The spread of a ray that does the work of so many: each stands for more.
  static float widened(float spread, float rays) {
    return std::max(spread, std::min(widest_spread, spread * std::sqrt(rays)));
  }
  float coat_weight(const integrate::PointBatch& b, const integrate::RaySet& r, int ray) const;
  /// Diffuse rays see in coats what these mirror; with caustics off a diffuse surface.
  bool coats_mirror(const Place& below) const { return settings_.caustics && below.arrival == Arrival::diffuse; }
  void trace_rays(integrate::RaySet& r, ShadingWorkspace& w) const;

  void light_subsurface(const Place& place, ShadingWorkspace& w) const;
  void send_probes(const Place& place, ShadingWorkspace& w) const;
  void trace_probes(int n, const integrate::PointBatch& b, SubsurfaceBatch& s, ShadingWorkspace& w) const;
  void gather_probes(const Place& place, ShadingWorkspace& w) const;
  int probes(const integrate::PointBatch& b, int k) const {
    return integrate::RayList::part(settings_.subsurface_rays, b.share[k]);
  }

  /// None serves viewers: what they see in mirrors is sharp.
  gi::RadiosityCache* cache_for(Arrival arrival) const {
    return arrival == Arrival::probe ? irradiance_cache_ : arrival == Arrival::diffuse ? cache_ : nullptr;
  }
  static gi::RadiosityCache::Counts& counts_for(Arrival arrival, ShadingWorkspace& w) {
    return arrival == Arrival::probe ? w.irradiance_caches : w.caches;
  }
  bool lies_near_light(const scene::GridId& tile, ShadingWorkspace& w) const;
  /// Adds to L of these rays of the first sets what leaves the surfaces that they met: from the nearest point in the
  /// cache of below.arrival where there is one that serves them, whose resolution follows from the width of the point
  /// that sent the ray, grown so, and the ray's cone; else by shading them at `below`. And what scatters into them
  /// where they ended in media.
  void gather_hits(const Place& place, const Place& below, float growth, RayFilter wanted, int sets,
                   ShadingWorkspace& w) const;
  /// Adds to L of these rays what scatters into them where they ended in media.
  void add_media(integrate::RaySet& r, const Place& below, RayFilter wanted, ShadingWorkspace& w) const;
  bool dice_hit(const integrate::PointBatch& b, const integrate::RaySet& r, int i, float growth,
                scene::PatchTable::PatchHit* hit, float* width, scene::GridPoint* at, ShadingWorkspace& w) const;
  int entry_at(const Place& below, const integrate::RaySet& r, int i, const scene::PatchTable::PatchHit& hit,
               float width, scene::GridPoint* at, gi::CacheBatch& c, ShadingWorkspace& w) const;
  void locate_radiosity(const Place& place, const Place& below, float growth, RayFilter wanted, int sets,
                        ShadingWorkspace& w) const;
  void add_radiosity(const Place& place, const Place& below, float growth, RayFilter wanted, int sets,
                     ShadingWorkspace& w) const;
  void fill(const Place& below, int begin, int end, gi::CacheBatch& c, ShadingWorkspace& w) const;
  void link_tiles(int begin, int end, gi::CacheBatch& c, ShadingWorkspace& w) const;
  void fill_batch(const Place& below, gi::CacheBatch& c, ShadingWorkspace& w) const;
  static void count_uses(const Place& below, const gi::CacheBatch& c, ShadingWorkspace& w);
  void survey_rays(const Place& place, const gi::CacheLog& log, gi::CacheAnswers* answers, ShadingWorkspace& w) const;

  const scene::Scene& scene_;
  const scene::PatchTable* const patches_;
  gi::RadiosityCache *const cache_, *const irradiance_cache_;
  const Settings settings_;
  const integrate::MaterialTable materials_;
  const integrate::RayTracer tracer_;
  const light::DirectLight direct_;
  const light::SurfaceMedia surface_media_;
  const gi::TileLinker linker_;
  const float common_area_;  ///< m2; cells of the cache that are larger send more rays
  /// No cell of the cache is wider, m: a spot of sun in a room is a part of a few cells, and how large a part they find
  /// out by few rays.
  const float widest_cell_;
};

}  // namespace dapple::distribution
