// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "dapple/build/integrator_factory.h"
#include "dapple/build/light_group_factory.h"
#include "dapple/image/image_writer.h"
#include "model_options.h"

namespace dapple::app {

/// What the command line of `dapple render` says. Empty strings, and numbers that no option takes: nothing.
struct RenderOptions {
  std::vector<std::string> outputs, gains;
  std::string scene, integrator, preset, shadow_rays, diffuse_rays, radiosity_cache, subsurface_cache, opacity_cache;
  std::string irradiance_interpolation, caustics, visible_points, light_learning, crop, resolution, aovs, stats, view,
      display, ocio, compression, exposure, tev, previous, next, lod;
  int bounces = -1, specular_depth = -1, pixel_samples = 0, max_pixel_samples = 0, threads = 0, png_bits = 0,
      pixel_points = -1, subsurface_rays = 0;
  std::optional<uint64_t> seed;
  double time_limit = 0, noise_target = 0, pixel_noise = 0, shading_rate = 0, max_distance = 0, cache_mb = -1,
         cache_width = 0, irradiance_accuracy = 0;
  build::MaskRequest masks;
  build::ShaftRequest shafts;
  build::ImageRequest images;
  bool color_bleeding = false, light_groups = false, strict = false, keep_going = false, quiet = false, watch = false;
  bool half = false, full_float = false, tiled = false, multi_part = false;
  std::string canopy_gather, canopy_answers, canopy_plot, show_cache, denoise, denoise_weights;
  float denoise_exposure = 0;
  int canopy_slabs = 0;
  ModelRequest model;
};

void add_render_options(CLI::App& app, RenderOptions& o);

/// What --gain says, GROUP=NUMBER or GROUP=R,G,B each. UsageError.
std::vector<build::GainOverride> gains(const std::vector<std::string>& texts);

/// UsageError for numbers that are none or out of range, options that exclude each other, and unknown AOVs.
void check_render_options(const RenderOptions& o);

/// The view of PNG and JPEG. UsageError for an exposure that is none.
image::DisplayView display_view(const RenderOptions& o);

/// UsageError for lists of rays that are none.
build::IntegratorRequest integrator_request(const RenderOptions& o);

/// Names options that the integrator, or the images, have no use for. UsageError or IoError for a view of OpenColorIO
/// that there is not.
void warn_of_unused(const RenderOptions& o, const build::IntegratorRequest& request,
                    const std::vector<std::string>& paths);

}  // namespace dapple::app
