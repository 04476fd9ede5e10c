// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/forest/ground_visibility.h"
#include "dapple/forest/mask_visibility.h"
#include "dapple/integrate/camera_paths.h"
#include "dapple/integrate/material_table.h"
#include "dapple/integrate/ray_tracer.h"
#include "dapple/light/light_learning.h"
#include "dapple/light/shaft_light.h"
#include "dapple/path/cached_ends.h"
#include "dapple/path/path_light.h"
#include "dapple/path/straight_flights.h"
#include "dapple/vegetation/canopy_transport.h"

namespace dapple::path {

/// Unbiased path tracing with next event estimation and multiple importance sampling (Veach 1997): the reference all
/// cached and approximate results are held against. Paths advance together, 256 of a block of pixels at a time: each
/// step traces all their rays, then shades all their hits, then traces all their shadow rays.
class PathIntegrator final : public integrate::CameraPaths {
 public:
  struct Settings {
    int diffuse_bounces = 4;  ///< diffuse scatterings of indirect light (scattering/lobes.h); 0 = direct light only
    int specular_depth = 16;  ///< glossy and delta scatterings
    int max_scatterings = 1 << 20;  ///< of any kind: pbrt's maxdepth - 1 where the scene asks for it
    int roulette_depth = 3;         ///< scatterings before Russian roulette may end a path
    uint64_t seed = 0;
    float texture_footprint = 1;  ///< scale of texture footprints, 1 = a pixel
    /// Answers for light of more than `diffuse_bounces`: at the last of these scatterings, or, if it gathers, at what
    /// the ray hits that looks for lights after it. Null: there is none.
    std::shared_ptr<const vegetation::CanopyTransport> canopy;
    bool canopy_gather = true;
    /// Paths that were scattered diffusely end in this canopy's solution where they meet diffuse leaves. Null: they go
    /// on.
    std::shared_ptr<const vegetation::CanopyTransport> leaf_answers;
    std::shared_ptr<const forest::MaskVisibility> masks;  ///< in place of shadow rays to sun and sky; null: none
    std::shared_ptr<const forest::GroundVisibility>
        far_ground;  ///< asked before `masks`, for which it answers too; null: none
    /// Light that media scatter from suns and lamps straight into camera rays; null: paths find it.
    std::shared_ptr<const light::ShaftLight> shafts;
    /// Where diffuse rays may end, so that the image is only as right as that; null: they go on.
    std::shared_ptr<const integrate::RadiosityAnswers> radiosity;
    /// From the camera, that learn what light reaches which part of the scene; 0: none.
    int learning_paths = 0;
    /// Where these paths would look for light; it does not depend on lights. Null: they are traced.
    std::shared_ptr<const std::vector<light::LightPoint>> light_points;
    StopToken stop;                                                 ///< of learning, which throws Stopped then
    std::shared_ptr<const emitters::LearnedLights> learned_lights;  ///< what is known of that already; null: nothing

    const emitters::Visibility* visibility() const {
      if (far_ground) return far_ground.get();
      return masks.get();
    }
  };

  PathIntegrator(const scene::Scene& scene, const Settings& settings);

  std::unique_ptr<Workspace> make_workspace() const override;
  void render(const integrate::TileWork& work, Workspace& workspace, scene::Film& film) const override;
  void trace(const std::vector<uint8_t>& others, const scene::Film::Settings& film, const StopToken& stop,
             integrate::PathSamples& s, Workspace& workspace) const override;
  std::vector<integrate::CacheState> caches() const override;
  bool tells_direct() const override { return true; }
  bool samples_are_independent() const override { return !ends_in_cache(); }
  const std::shared_ptr<const vegetation::CanopyTransport>& leaf_answers() const { return settings_.leaf_answers; }
  integrate::ShaftTables shaft_tables() const override { return flights_.tables(); }
  bool ends_in_cache() const { return bool(ends_); }
  /// What the paths of Settings::learning_paths have learned; null: nothing.
  const std::shared_ptr<const emitters::LearnedLights>& learned_lights() const { return learned_; }
  /// Settings::light_points of the same scene with other lights; null where nothing was learned, and once taken.
  std::shared_ptr<const std::vector<light::LightPoint>> take_light_points() { return std::move(light_points_); }
  struct SeenLeaves {
    std::vector<LeafNote> notes;
    double light = 0;  ///< luminance of all paths, added up
    int paths = 0;
  };
  /// What so many paths from all over the film find at leaves; `is_leaf`: by geometry. A function of its arguments, the
  /// scene and Settings. May throw Stopped.
  SeenLeaves look_at_leaves(int paths, const std::vector<uint8_t>& is_leaf, StopToken stop) const;
  /// Radiance w.L along the rays of w.camera, by the samples that its seeds and indices name.
  void trace_camera_rays(PathWorkspace& w) const {
    start_paths(w);
    trace_paths(0, w);
    if (flights_) trace_straight_flights(w);
  }
  /// The same where it is known what the rays of w.camera meet first. Media scatter none of them but by shafts.
  void trace_from_hits(const trace::HitBatch& hits, PathWorkspace& w) const;

 private:
  void learn();
  void prepare(const scene::Film::Settings& film, const StopToken& stop, PathWorkspace& w) const;
  std::vector<light::LightPoint> find_light_points() const;
  void start_paths(PathWorkspace& w) const;
  void trace_paths(uint32_t first_step, PathWorkspace& w) const;
  void take_step(uint32_t step, PathWorkspace& w) const;
  void shade_points(uint32_t step, PathWorkspace& w) const;
  void collect_hits(PathWorkspace& w) const;
  void prelight(PathWorkspace& w) const;
  void describe_first_surfaces(PathWorkspace& w) const;
  void pass_through(int point, PathWorkspace& w) const;
  bool pass_sheet(int point, PathWorkspace& w) const;
  void fly(PathWorkspace& w) const;
  bool arrive(int ray, PathWorkspace& w) const;
  void trace_straight_flights(PathWorkspace& w) const;
  bool walk(int ray, PathWorkspace& w) const;
  bool gathers() const { return settings_.canopy && settings_.canopy_gather; }
  void add_canopy_light(int point, const vegetation::CanopyTransport& canopy, PathWorkspace& w) const;
  void end_in_canopy(int point, const vegetation::CanopyTransport& canopy, PathWorkspace& w) const;
  static bool may_end_in_leaf(int point, const PathWorkspace& w);
  void note_leaf(int point, PathWorkspace& w) const;
  void scatter_in_medium(int point, PathWorkspace& w) const;
  bool end_or_go_on(int point, scattering::Lobe lobe, PathWorkspace& w) const;
  void disperse(int point, PathWorkspace& w) const;
  void scatter(int point, PathWorkspace& w) const;
  void cross_boundary(int point, const scattering::BsdfSample& sample, PathWorkspace& w) const;

  const scene::Scene& scene_;
  const Settings settings_;
  const integrate::MaterialTable materials_;
  const integrate::RayTracer rays_;
  const StraightFlights flights_;
  const PathLight light_;
  const CachedEnds ends_;
  bool hit_lights_ = false;  ///< some light can be met by a ray
  std::shared_ptr<const emitters::LearnedLights> learned_;
  std::shared_ptr<const std::vector<light::LightPoint>> light_points_;
};

}  // namespace dapple::path
