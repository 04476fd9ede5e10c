// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dapple/image/image_writer.h"
#include "dapple/render/cache_colors.h"
#include "dapple/render/frame_denoiser.h"
#include "dapple/scene/film.h"

namespace dapple::render {

/// Names that --aov takes, in the order they are written: those that "all" means, those of light shafts, and those of
/// the radiosity cache. There are "motion", "direct" and "error" beside them.
const std::vector<std::string>& aov_names();
const std::vector<std::string>& air_aov_names();
const std::vector<std::string>& cache_aov_names();

/// Splits "albedo,normal" and checks each name. UsageError lists the legal names.
std::vector<std::string> parse_aovs(const std::string& list);
/// Whether an AOV is of the film's own (Film::Settings::features, air, cache_use), not traced apart.
bool from_film(const std::string& aov);
/// Whether these need OutputSettings::motion, Film::Settings::air, Film::Settings::cache_use.
bool show_motion(const std::vector<std::string>& aovs);
bool show_error(const std::vector<std::string>& aovs);
bool show_direct(const std::vector<std::string>& aovs);
bool show_air(const std::vector<std::string>& aovs);
bool show_cache_use(const std::vector<std::string>& aovs);

struct OutputSettings {
  std::vector<std::string> aovs;
  std::vector<std::string> light_groups;    ///< names, as many as the film keeps
  std::optional<CacheView> cache_view;      ///< in place of the picture
  std::optional<FeatureLayers> features;    ///< AOVs albedo and normal, over the film's crop
  std::optional<image::Image> motion;       ///< AOV motion, likewise
  std::optional<image::Image> motion_back;  ///< beside AOV motion, where that is known
  std::optional<image::Image> error;        ///< AOV error, likewise
  std::optional<Box2i> window;              ///< pixels to write, of the film's; all if none
  std::optional<DenoisedFrame> denoised;    ///< the picture and its light groups
  bool loops = true;                        ///< over rows, in parallel
  V3d origin{0, 0, 0};                      ///< added to positions, build::BuiltScene::origin
  std::vector<std::pair<std::string, image::MetadataValue>> metadata;
};

/// The film as a picture: R, G, B; where these are denoised, "noisy" as it was rendered; then a layer for each AOV:
/// albedo, normal, motion (and motion_back), depth ("Z"), position ("P"), variance, error, samples, alpha ("A"), patch,
/// grid_point, dice_level, shading_rate, cache_level, cache_age, cache_fills, cache_reuse; then "light.NAME" for each
/// light group. Crops keep the full display window; of a film with a border around them, `window` is what is written.
/// std::logic_error for albedo, normal, motion and error without what OutputSettings hold of them, and for names that
/// are no AOV.
image::OutputImage make_output(const scene::Film& film, const OutputSettings& settings);

}  // namespace dapple::render
