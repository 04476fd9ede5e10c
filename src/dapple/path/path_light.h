// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/integrate/ray_tracer.h"
#include "dapple/media/phase_function.h"
#include "dapple/path/path_workspace.h"
#include "dapple/path/straight_flights.h"

namespace dapple::path {

/// The light of paths: what shines where their rays go, and samples of lights at the points of a step with their shadow
/// rays, joined by multiple importance sampling (Veach 1997, power heuristic). Points are numbers of surfaces and
/// scatterings in the workspace.
class PathLight {
 public:
  /// All must outlive this object.
  PathLight(const scene::Scene& scene, const integrate::RayTracer& rays, const StraightFlights& flights)
      : scene_(scene), rays_(rays), flights_(flights) {}

  // What the rays of paths meet.
  void add_environment(int path, const V3f& o, const V3f& d, PathWorkspace& w) const;
  void add_emission(int path, uint32_t light, const geom::SurfacePoint& s, const V3f& d, PathWorkspace& w) const;
  void add_glow(int path, const RGB& emitted, const V3f& o, const V3f& d, PathWorkspace& w) const;

  /// Makes a point of a surface the receiver of its path: of light samples there, and of the path's next ray.
  /// `learned`: may be null.
  static void set_receiver(int point, const emitters::LearnedLights* learned, PathWorkspace& w);
  // Draw a light and a shadow ray, or, of paths that learn, note where they would.
  void light_surface(int point, PathWorkspace& w) const;
  void light_end(int point, float weight, PathWorkspace& w) const;
  void light_medium(int point, const emitters::LightReceiver& receiver, const media::HenyeyGreenstein& phase,
                    PathWorkspace& w) const;
  void find_delta_light(int point, const V3f& wi, PathWorkspace& w) const;
  /// Adds the light of all that were drawn in this step.
  void trace_shadows(PathWorkspace& w) const;

 private:
  template <class Evaluate>
  void connect(int point, const emitters::LightReceiver& receiver, const geom::SurfacePoint* surface,
               const Evaluate& evaluate, PathWorkspace& w) const;
  void note_point(int point, PathWorkspace& w) const;

  const scene::Scene& scene_;
  const integrate::RayTracer& rays_;
  const StraightFlights& flights_;
};

}  // namespace dapple::path
