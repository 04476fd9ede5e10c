// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/emitters/learned_lights.h"
#include "dapple/integrate/ray_list.h"
#include "dapple/light/direct_numbers.h"
#include "dapple/light/light_workspace.h"

namespace dapple::light {

class ShaftLight;

/// Light that reaches batches of points straight from its sources: by shadow rays, and by rays that met a source. Each
/// light gets its own stratified shadow rays; where there are more than DirectNumbers::lights_apart, that many times
/// the rays of one choose lights by importance, and so does a point that does a part of another's work
/// (PointBatch::share), by that part of these rays. Diffuse rays that look for lights (PointBatch::seekers), and rays
/// by other lobes, share lights with shadow rays by the power heuristic (Veach 1997).
class DirectLight {
 public:
  /// `shadow_rays`: a point and light, by diffuse depth. `learned`: what is known of the scene's light; null: nothing.
  /// The others must outlive this object.
  DirectLight(const scene::Scene& scene, const integrate::RayTracer& tracer, const integrate::RayList& shadow_rays,
              std::shared_ptr<const emitters::LearnedLights> learned = nullptr);

  /// There is something to learn: which of several lights, or which part of a sky, is seen.
  static bool pays_to_learn(const scene::Scene& scene);

  /// Shadows may have edges as sharp as those of what throws them: a light has no size, or surrounds the scene, where a
  /// sun may be painted.
  bool throws_edges() const { return throws_edges_; }
  /// Some light has no size: what metal and coats mirror of it is narrow.
  bool glints() const { return glints_; }

  /// Diffuse rays that are to look for lights at a point that needs none for indirect light: where a sky is seen
  /// through a window, shadow rays alone seldom find it where nothing told them to look. As many as shadow rays; 0
  /// without a sky.
  int looking_rays(const integrate::PointBatch& b, int k, int diffuse_depth) const {
    return has_sky_ ? share_of(b, k, diffuse_depth).rays : 0;
  }
  /// Sends shadow rays from the points for which wanted[k]. Adds irradiance, b.irradiance and b.irradiance_behind,
  /// where the Bsdf is purely diffuse, and what is scattered to the viewer, b.specular, where it is not. Of these,
  /// b.seekers[k] diffuse rays, and w.counts[k] rays by the Bsdf, look for lights besides.
  void light(integrate::PointBatch& b, int diffuse_depth, const bool* wanted, LightWorkspace& w) const;
  /// The other part: sets L of rays that were traced, of density pdf, to what shines where they ended.
  void add_lights_hit(const integrate::PointBatch& b, integrate::RaySet& r, int diffuse_depth) const;
  /// Of points in media, all of the batch: adds to b.Ci the light that they scatter to the viewer.
  /// `but`: light that is its own is left out; null: none.
  void light_media(integrate::PointBatch& b, int diffuse_depth, const ShaftLight* but, LightWorkspace& w) const;
  int group(uint32_t light) const { return group_[light]; }

  /// Add to L[p] the radiance that arrives at o along direction -d from lights at infinity, and from an emitter that
  /// was hit.
  void add_environment(const V3f& o, const V3f& d, integrate::LightSums& L, int p) const;
  void add_emission(const trace::HitBatch& hits, int i, const geom::SurfacePoint& s, const V3f& d,
                    integrate::LightSums& L, int p) const;

 private:
  /// Shadow rays of a point: to each light, or to lights that each of them chooses.
  struct Share {
    int rays;
    bool chooses;
  };
  Share share_of(const integrate::PointBatch& b, int k, int diffuse_depth) const;
  int chosen_rays(int rays, int share) const {
    return integrate::RayList::part(rays * std::min(int(scene_.lights.size()), DirectNumbers::lights_apart), share);
  }
  emitters::LightReceiver receiver(const integrate::PointBatch& b, int k, const integrate::RayOrigin& from) const;
  emitters::LightRegion region(const integrate::PointBatch& b, int k) const;
  float density(const emitters::LightReceiver& to, uint32_t light, const V3f& wi, const geom::SurfacePoint& s,
                const Share& share) const;
  void draw(integrate::PointBatch& b, int diffuse_depth, LightWorkspace& w) const;
  void draw_lights(const integrate::PointBatch& b, int begin, int end, LightWorkspace& w) const;
  void draw_from_one_place(const integrate::PointBatch& b, std::span<int> jobs, LightWorkspace& w) const;
  bool add_shadow_ray(const integrate::PointBatch& b, int diffuse_depth, int job, const integrate::RayOrigin& from,
                      LightWorkspace& w) const;
  void add_shadow_rays(integrate::PointBatch& b, int diffuse_depth, int first, int last, LightWorkspace& w) const;
  void trace(LightWorkspace& w) const;

  const scene::Scene& scene_;
  const integrate::RayTracer& tracer_;
  const integrate::RayList shadow_rays_;
  const std::shared_ptr<const emitters::LearnedLights> learned_;
  bool throws_edges_ = false, glints_ = false, has_sky_ = false;
  std::vector<uint8_t> one_ray_serves_, group_;  // by light
};

}  // namespace dapple::light
