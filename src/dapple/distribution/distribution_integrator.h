// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/grid_store.h"
#include "dapple/distribution/irradiance_interpolator.h"
#include "dapple/forest/ground_visibility.h"
#include "dapple/forest/mask_visibility.h"

namespace dapple::distribution {

struct CameraSample;
struct DistributionWorkspace;

/// Distribution ray tracing on shading grids: the REYES decoupling of shading from visibility (Cook et al. 1987), with
/// a ray-traced hider. Surfaces that camera rays hit are shaded at the points of a lattice of about one point for
/// `shading_rate` pixels, each once a frame however many camera samples see it; where something moves, once in each
/// motion segment (scene::Motion). Of small patches a few are chosen for each pixel (PixelPoints). What depends sharply
/// on the view (mirrors, glass, layered and glossy materials) is added per camera sample, with prelighting interpolated
/// from the lattice.
class DistributionIntegrator final : public integrate::Integrator {
 public:
  struct Settings {
    HitShader::Settings shading;
    float shading_rate = 1;  ///< area of a micropolygon in pixels
    int pixel_samples = 16;  ///< that a pixel gets
    int max_pixel_samples =
        0;  ///< the same where it is noisy, if that is more: so many share what mirrors, gloss and media show there
    /// Of patches of few points, as leaves are, so many are shaded that a pixel's samples see, and one of each further
    /// material and side; 0: all.
    int pixel_points = 3;
    size_t grid_bytes = size_t(512) << 20;   ///< of shading grids kept; beyond, they are shaded again
    bool radiosity_cache = true;             ///< diffuse rays end in it; else what they hit is shaded
    bool subsurface_cache = true;            ///< the light that enters subsurface bodies is cached too
    size_t cache_bytes = size_t(100) << 20;  ///< of all caches of view-independent results
    bool irradiance_interpolation =
        false;                         ///< of diffuse rays of visible points; their number is that of a hemisphere then
    float irradiance_accuracy = 0.4f;  ///< IrradianceInterpolator::Settings::accuracy
    bool light_groups = false;         ///< what groups of lights give is kept apart, for films that ask for it
    bool log_caches = false;           ///< for view_caches(): at most 70 MB a thread
    std::shared_ptr<const forest::MaskVisibility> masks;  ///< in place of shadow rays to sun and sky; null: none
    std::shared_ptr<const forest::GroundVisibility>
        far_ground;  ///< asked before `masks`, for which it answers too; null: none
  };

  DistributionIntegrator(const scene::Scene& scene, const Settings& settings);

  std::unique_ptr<Workspace> make_workspace() const override;
  void render(const integrate::TileWork& work, Workspace& workspace, scene::Film& film) const override;
  void finish(std::span<const std::unique_ptr<Workspace>> workspaces, scene::Film& film) const override;

  std::vector<integrate::CacheState> caches() const override;
  void view_caches(uint32_t pixel_samples, scene::Film& film) const override;

 private:
  std::vector<integrate::CacheState> with_mask_state(std::vector<integrate::CacheState> states) const;
  void locate_samples(const Box2i& pixels, uint32_t sample, DistributionWorkspace& w) const;
  void lend_points(const Box2i& pixels, uint32_t sample, DistributionWorkspace& w) const;
  void trace_camera_rays(DistributionWorkspace& w) const;
  void locate_hits(DistributionWorkspace& w) const;
  bool needs_tangents_where_seen(uint32_t geometry) const {
    return shader_.materials().needs_tangents(geometry) && !shader_.materials().is_view_independent(geometry);
  }
  bool dice(int p, float finer, DistributionWorkspace& w) const;
  void add_media(DistributionWorkspace& w) const;
  void find_points(DistributionWorkspace& w) const;
  bool restrict_points(CameraSample& s) const;
  void find_grids(int n, DistributionWorkspace& w) const;
  void shade_claimed(int left, DistributionWorkspace& w) const;
  void shade_all_claimed(std::span<const std::unique_ptr<Workspace>> workspaces) const;
  void add_points(ShadingGrid& grid, ShadingGrid::Parts points, integrate::PointBatch& b,
                  DistributionWorkspace& w) const;
  scene::GridId patches_seen(const scene::GridId& grid, DistributionWorkspace& w) const;
  struct Shares {
    int rays = 1, diffuse = 1;  ///< PointBatch::share and crowd
  };
  /// What the points of a grid have in common.
  struct SeenGrid {
    scene::GridId id;
    scene::PatchTable::Cell cell;
    Shares shares;
    const gi::TileLinks& links;
  };
  SeenGrid seen_grid(const ShadingGrid& grid, DistributionWorkspace& w) const;
  void set_grid_point(const SeenGrid& grid, int i, int j, integrate::PointBatch& b, int k,
                      DistributionWorkspace& w) const;
  int finest_step(const scene::PatchTable::Cell& cell, const V3f& P) const;
  Shares shared_work(const scene::GridId& grid, DistributionWorkspace& w) const;
  int points_in_pixel(const scene::GridId& grid, DistributionWorkspace& w) const;
  void shade_batch(DistributionWorkspace& w) const;
  void finish_ready(DistributionWorkspace& w, scene::Film& film) const;
  void finish_waiting(DistributionWorkspace& w, scene::Film& film) const;
  void finish_some_waiting(DistributionWorkspace& w, scene::Film& film) const;
  void finish_samples(integrate::LightSums& L, DistributionWorkspace& w, scene::Film& film) const;
  void set_point(const CameraSample& s, integrate::PointBatch& b, int k) const;
  scene::GridFeatures describe_grid(const CameraSample& s, scene::PatchTable::Extents* extents) const;
  void collect_counts(DistributionWorkspace& w) const;
  void view_block(const Box2i& pixels, const gi::CacheLog& log, double seconds, DistributionWorkspace& w,
                  scene::Film& film) const;

  int sharing_samples() const { return std::max(settings_.pixel_samples, settings_.max_pixel_samples); }
  bool chooses_points() const;
  /// Diffuse: 0 is what scattering in media sees.
  int first_cached_depth() const { return scene_.has_media() ? 0 : 1; }

  /// Which caches there are, and how they share the memory; those that are not take none.
  struct CacheUse {
    CacheUse(const scene::Scene& scene, const Settings& settings);
    const bool subsurface, hemispheres;
    const size_t subsurface_bytes, hemisphere_bytes, radiosity_bytes;
  };

  const scene::Scene& scene_;
  const Settings settings_;
  const int groups_;  // of lights, whose parts are kept apart
  const scene::PatchTable patches_;
  const CacheUse use_;
  const std::unique_ptr<gi::RadiosityCache> irradiance_, radiosity_;
  const HitShader shader_;
  std::unique_ptr<const IrradianceInterpolator> interpolator_;
  mutable GridStore grids_;
  const std::unique_ptr<gi::CacheLogs> logs_;
};

}  // namespace dapple::distribution
