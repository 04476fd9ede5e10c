// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "dapple/build/build_context.h"
#include "dapple/scene/camera.h"
#include "dapple/scene/film.h"
#include "dapple/scene/filter.h"

namespace dapple::build {

/// What the command line may put in the place of the scene's own film settings.
struct FilmOverrides {
  std::optional<V2i> resolution;
  std::optional<Box2i> crop;  ///< pixels, [min, max)
};

/// Film settings of the scene and what else its Film directive asks for.
struct FilmRequest {
  scene::Film::Settings film;
  std::string filename;
  std::string place;     ///< of the directive, "file:line:column"; empty if there is none
  bool half = true;      ///< save as 16-bit float
  bool gbuffer = false;  ///< write the AOVs
};

FilmRequest make_film(const BuildContext& context, const FilmOverrides& overrides);
scene::Camera make_camera(const BuildContext& context, const V2i& resolution);
/// That of DicingCamera, for which surfaces are diced; without one `camera`.
scene::Camera make_dicing_camera(const BuildContext& context, const FilmOverrides& overrides,
                                 const scene::Camera& camera);
scene::Filter make_filter(const BuildContext& context);

/// Largest image side and largest number of samples a pixel that is taken as meant.
inline constexpr int max_resolution = 65536;
inline constexpr int64_t max_pixels = int64_t(1) << 28;
inline constexpr int max_pixel_samples = 1 << 20;

}  // namespace dapple::build
