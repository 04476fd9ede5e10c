// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/depthimage/image_numbers.h"
#include "dapple/impostor/image_view.h"
#include "dapple/impostor/projection_device.h"
#include "dapple/path/path_integrator.h"

namespace dapple::impostor {

/// Trees from multilayer images (Max and Ohsaki 1995; Max 1996; illumination under trees, 1): far instances are
/// projected from the images of their objects into sub-samples of each pixel, and lit after that; near ones, and all
/// that is no image, are seen by one ray a pixel and sample, each hiding the other. Light of
/// sun and sky comes by shadow rays, or masks, that meet all leaves; light that leaves scattered by the canopy's
/// solution.
///
/// One camera sample of a pixel is one set of 16 sub-samples, so that images are without jags from the first on. They
/// are filtered by a box of a pixel.
class ImageIntegrator final : public integrate::Integrator {
 public:
  struct Settings {
    /// Of what is seen by rays; `canopy` is needed, masks are for all. Where neither gathering nor bounces are asked
    /// for, diffuse surfaces that rays meet are lit as those of images are, and only the rest by path tracing.
    path::PathIntegrator::Settings rays;
    float texel_pixels = depthimage::ImageNumbers::texel_pixels;
    int pixel_points = 2;  ///< of what images show in a pixel, to be lit for a camera sample
    std::shared_ptr<ProjectionDevice> device = nullptr;  ///< null: projection by the CPU
  };

  /// std::invalid_argument for cameras (screen_map()) and media, but for air without bounds for whose light
  /// `rays.shafts` alone answer (ShaftLight::single). The scene must outlive it.
  ImageIntegrator(const scene::Scene& scene, TreeImages images, const Settings& settings);

  std::unique_ptr<Workspace> make_workspace() const override;
  void render(const integrate::TileWork& work, Workspace& workspace, scene::Film& film) const override;
  /// And, with a device, "gl.textures": draw calls as look-ups, bindings of textures as fills.
  std::vector<integrate::CacheState> caches() const override;

  const ImageView& view() const { return view_; }

 private:
  struct ImageWorkspace;
  void render_block(const Box2i& block, uint32_t sample, ImageWorkspace& w, scene::Film& film) const;
  void project(const Box2i& pixels, uint32_t sample, ImageWorkspace& w) const;
  V2f jitter(uint32_t sample) const;
  void see_by_rays(uint32_t sample, ImageWorkspace& w) const;
  void splat(const Box2i& block, uint32_t sample, ImageWorkspace& w) const;
  void resolve_pixel(int lane, ImageWorkspace& w) const;
  void add_points(int lane, const uint32_t* records, int count, ImageWorkspace& w) const;
  void light_points(ImageWorkspace& w) const;
  void queue_shadow(int point, int light, ImageWorkspace& w) const;
  void trace_shadows(ImageWorkspace& w) const;
  bool is_lit_alike(uint32_t geometry) const;
  bool answers_for_air() const;
  RGB look_through_air(int lane, const scene::CameraRay& seen, float length, float weight, ImageWorkspace& w) const;
  void add_hits(ImageWorkspace& w) const;
  void light_hits(ImageWorkspace& w) const;
  float depth_of_plane(const V3f& P, const V3f& n, const V2f& film) const;

  const scene::Scene& scene_;
  const Settings settings_;
  const TreeImages images_;
  const ImageView view_;
  const path::PathIntegrator rays_;
  const integrate::MaterialTable materials_;
  const integrate::RayTracer tracer_;
  std::vector<uint32_t> each_light_;   // where all of a few are sampled; else one is chosen
  std::vector<uint8_t> at_one_point_;  // by each_light_: of a pixel
  V3f origin_, origin_x_, origin_y_, direction_, direction_x_, direction_y_;  // of camera rays by film, depth 1 a unit
};

}  // namespace dapple::impostor
