// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/distribution/grid_finder.h"
#include "dapple/distribution/grid_shader.h"
#include "dapple/distribution/path_answers.h"
#include "dapple/distribution/reader_survey.h"
#include "dapple/distribution/sample_finisher.h"

namespace dapple::distribution {

struct DistributionWorkspace;

/// Distribution ray tracing on shading grids: the REYES decoupling of shading from visibility (Cook et al. 1987), with
/// a ray-traced hider. Surfaces that camera rays hit are shaded at the points of a lattice of about one point for
/// `shading_rate` pixels, each once a frame however many camera samples see it; where something moves, once in each
/// motion segment (scene::Motion). Of small patches a few are chosen for each pixel (PixelPoints). What depends sharply
/// on the view (mirrors, glass, layered and glossy materials) is added per camera sample, with prelighting interpolated
/// from the lattice.
///
/// A camera sample goes through Hider (what is seen), GridFinder (which points serve it), GridShader (these points are
/// shaded) and SampleFinisher (light by the view, film).
class DistributionIntegrator final : public integrate::Integrator {
 public:
  using Settings = DistributionSettings;

  DistributionIntegrator(const scene::Scene& scene, const Settings& settings);

  std::unique_ptr<Workspace> make_workspace() const override;
  void render(const integrate::TileWork& work, Workspace& workspace, scene::Film& film) const override;
  void finish(std::span<const std::unique_ptr<Workspace>> workspaces, scene::Film& film) const override;

  bool tells_direct() const override { return paths_ != nullptr; }
  bool tells_all_direct() const override { return false; }
  void begin_again() const override;
  std::vector<integrate::CacheState> caches() const override;
  integrate::ShaftTables shaft_tables() const override {
    return settings_.shading.shafts ? settings_.shading.shafts->tables() : integrate::ShaftTables();
  }
  void view_caches(uint32_t pixel_samples, scene::Film& film) const override;
  /// Camera samples that no grids serve may be traced as paths, sooner: those end their diffuse rays in these answers.
  /// Null where they may not.
  const integrate::RadiosityAnswers* answers() const { return samples_may_be_paths() ? &*answers_ : nullptr; }
  /// What paths should leave to grids, by geometry: subsurface bodies and dear shaders.
  const std::vector<uint8_t>& not_for_paths() const { return not_for_paths_; }
  /// Traces camera samples that need no grids as such paths, which may read answers(). To be called before anything is
  /// rendered, if at all, where there are answers().
  void set_paths(std::unique_ptr<const integrate::CameraPaths> paths);
  /// Share of the diffuse rays that cells of the cache will answer (ReaderSurvey), as far as that is known.
  float answered() const { return readers_ ? readers_->answered : 1; }
  /// What was surveyed, for DistributionSettings::readers; null: nothing.
  const std::shared_ptr<const SurveyedReaders>& readers() const { return readers_; }

 private:
  std::unique_ptr<const IrradianceInterpolator> make_interpolator() const;
  void survey_readers();
  std::vector<integrate::CacheState> with_mask_state(std::vector<integrate::CacheState> states) const;
  void add_media(DistributionWorkspace& w, scene::Film& film) const;
  bool samples_may_be_paths() const;
  void trace_paths(const Box2i& pixels, uint32_t sample, const StopToken& stop, DistributionWorkspace& w,
                   scene::Film& film) const;
  void locate(const Box2i& pixels, uint32_t sample, DistributionWorkspace& w) const;
  void shade_when_it_pays(DistributionWorkspace& w, scene::Film& film) const;
  void shade_all_claimed(std::span<const std::unique_ptr<Workspace>> workspaces) const;
  void finish_all(DistributionWorkspace& w, scene::Film& film) const;
  void collect_counts(DistributionWorkspace& w) const;
  void view_block(const Box2i& pixels, const gi::CacheLog& log, double seconds, DistributionWorkspace& w,
                  scene::Film& film) const;
  /// Diffuse: 0 is what scattering in media sees.
  int first_cached_depth() const { return scene_.has_media() ? 0 : 1; }

  /// Which caches there are, and how they share the memory; those that are not take none.
  struct MemoryShares {
    MemoryShares(const scene::Scene& scene, const Settings& settings);
    const bool subsurface, hemispheres;
    const size_t subsurface_bytes, hemisphere_bytes, radiosity_bytes;
  };

  const scene::Scene& scene_;
  const Settings settings_;
  const int groups_;  // of lights, whose parts are kept apart
  const scene::PatchTable patches_;
  const MemoryShares shares_;
  const std::unique_ptr<gi::RadiosityCache> irradiance_, radiosity_;
  ShadingScene shading_;
  const PointPlacer placer_;
  const HitShader shader_;
  const std::unique_ptr<const IrradianceInterpolator> interpolator_;
  mutable GridStore grids_;
  const Hider hider_;
  const GridFinder finder_;
  const GridShader grid_shader_;
  const SampleFinisher finisher_;
  const std::unique_ptr<gi::CacheLogs> logs_;
  std::optional<PathAnswers> answers_;
  std::shared_ptr<const SurveyedReaders> readers_;
  std::vector<uint8_t> not_for_paths_;
  std::unique_ptr<const integrate::CameraPaths> paths_;
  std::vector<size_t> cache_of_paths_;  // which of caches() theirs are
};

}  // namespace dapple::distribution
