// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "dapple/build/build_context.h"
#include "dapple/build/image_factory.h"
#include "dapple/build/mask_factory.h"
#include "dapple/build/shaft_factory.h"
#include "dapple/distribution/distribution_settings.h"
#include "dapple/integrate/ray_list.h"

namespace dapple::build {

/// What is said about the integrator by a scene file or on a command line; what is not said is empty.
struct IntegratorRequest {
  std::string type;    ///< one of integrator_types
  std::string preset;  ///< "draft", "preview" or "final"
  std::optional<uint64_t> seed;
  std::optional<int> pixel_samples, max_pixel_samples;
  std::optional<float> pixel_noise;
  std::optional<int> max_depth;  ///< pbrt's: scatterings of any kind, the last only to find a light
  std::optional<int> bounces, specular_depth;
  std::optional<integrate::RayList> shadow_rays, diffuse_rays;
  std::optional<int> subsurface_rays;
  std::optional<distribution::VisiblePoints> visible_points;
  std::optional<float> shading_rate;
  std::optional<int> pixel_points;
  std::optional<bool> radiosity_cache, subsurface_cache, opacity_cache, irradiance_interpolation, caustics;
  std::optional<bool> denoise;         ///< of a preset: with distribution only
  std::optional<bool> light_learning;  ///< path, canopy and distribution
  bool light_groups = false;           ///< distribution: what each gives is kept apart (path: if the film asks for it)
  bool log_caches = false;             ///< for pictures of the radiosity cache
  std::optional<float> cache_mb, cache_width, irradiance_accuracy;
  MaskRequest masks;                   ///< path and distribution
  ShaftRequest shafts;                 ///< path, distribution and canopy
  ImageRequest images;                 ///< images
  std::optional<float> max_distance;   ///< ao, m
  std::optional<bool> color_bleeding;  ///< ao
  // canopy and images: vegetation::CanopyTransport::Settings
  std::optional<bool> canopy_gather;
  std::optional<bool> leaf_answers;         ///< path and distribution; empty: with distribution where they pay
  std::optional<Imath::Box2d> canopy_plot;  ///< in the coordinates of the file
  V3d origin{0, 0, 0};                      ///< of the scene
  std::optional<int> canopy_slabs;
  std::vector<int32_t> canopy_ground;  ///< materials; empty: not said
  std::string place;                   ///< of the scene's directive, for messages

  /// This, and where it is silent, `other`.
  IntegratorRequest over(const IntegratorRequest& other) const;
};

inline constexpr std::string_view integrator_types[] = {"path", "distribution", "canopy", "images", "ao"};
inline constexpr std::string_view visible_points_names[] = {"grids", "samples"};  ///< distribution::VisiblePoints
inline constexpr std::string_view preset_names[] = {"draft", "preview", "final"};
/// Most rays of a kind that a shading point may send, and most scatterings of a kind that distribution ray tracing
/// follows: its recursion is at most about their product deep, up to 3.5 MB and a few kB of stack a level and thread.
inline constexpr int max_rays = 65536;
inline constexpr int max_depth_followed = 32;
inline constexpr int max_canopy_slabs = 1000;
inline constexpr int max_pixel_points = 256;

inline constexpr int default_max_depth = 5;  ///< pbrt's

/// The scene's Option, Sampler and Integrator directives. Throws InputError.
IntegratorRequest make_integrator_request(const BuildContext& context);

/// One of visible_points_names.
distribution::VisiblePoints visible_points_of(std::string_view name);

/// What a preset stands for (docs/guide/rendering.md). "" is "preview".
IntegratorRequest preset_request(const std::string& name);

/// Paths for a sketch of what the request asks for: as many bounces, with little learned, nothing cached or put into
/// tables beforehand, so that it is there at once.
IntegratorRequest sketch_request(const IntegratorRequest& request);

}  // namespace dapple::build
