// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "dapple/integrate/material_table.h"
#include "dapple/integrate/ray_tracer.h"

namespace dapple::integrate {

/// Albedo and normal of what each pixel shows, as denoisers want them (the documentation of Open Image Denoise says
/// what works well):
/// - a surface its albedo, reflected plus transmitted, and its normal towards the viewer, where metal and glass are
/// rough too;
/// - smooth metal what is seen in it, times its reflectance; smooth glass what is seen in it and through it, mixed by
/// Fresnel, of
///   which the first ones are followed apart and later ones the stronger way;
/// - what shines its colour, no brighter than 1, beside its albedo; the sky likewise, without a normal; media nothing.
/// Means over camera samples, so that edges, lens and motion blur show; rendering takes the same samples.
class FeatureTracer {
 public:
  struct Settings {
    int samples = 16;  ///< camera samples a pixel
    uint64_t seed = 0;
    uint32_t pixel_samples = PixelSets::most_samples;  ///< TileWork's
  };
  struct Layers {
    std::vector<RGB> albedo;  ///< row-major over the pixels asked for, in [0, 1]
    std::vector<V3f> normal;  ///< world space, no longer than 1; shorter where normals differ
  };

  FeatureTracer(const scene::Scene& scene, const Settings& settings)
      : scene_(scene), settings_(settings), materials_(scene), tracer_(scene, materials_, false) {}

  /// Of the pixels [min, max), on all threads; the same for any number of them. May throw Stopped.
  Layers trace(const Box2i& pixels, StopToken stop = {}) const;

 private:
  struct Workspace;
  void trace_block(const Box2i& block, Workspace& w) const;
  void start_rays(Workspace& w) const;
  void follow_rays(Workspace& w) const;
  void add_sky(int ray, Workspace& w) const;
  void describe(int point, Workspace& w) const;
  bool follow_specular(int point, Workspace& w) const;
  RGB displayed(const RGB& L) const;

  const scene::Scene& scene_;
  const Settings settings_;
  const MaterialTable materials_;
  const RayTracer tracer_;
};

}  // namespace dapple::integrate
