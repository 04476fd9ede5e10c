// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/mask_factory.h"

#include <fmt/format.h>

#include <algorithm>

#include "dapple/base/log.h"
#include "dapple/base/timer.h"
#include "dapple/integrate/medium_borders.h"
#include "dapple/vegetation/ground_survey.h"
#include "dapple/vegetation/mask_scene.h"

namespace dapple::build {

namespace {

constexpr float default_mb = 512;
constexpr float widest_pixel = 1e6f, most_mb = 1e6f;
constexpr float farthest = 1e9f;
constexpr size_t facet_bytes = size_t(8) << 30;

template <class T>
std::string shown(T value) {
  std::string text = std::to_string(value);
  if (text.find('.') != std::string::npos) text.erase(std::max(text.find_last_not_of('0'), text.find('.') + 1) + 1);
  return text;
}

// Why light that masks let through cannot be weakened on its way; empty: it can.
std::string obstacle_of_media(const scene::Scene& scene) {
  return integrate::MediumBorders::obstacle(scene, integrate::MaterialTable(scene));
}

}  // namespace

MaskRequest MaskRequest::over(const MaskRequest& other) const {
  MaskRequest r = *this;
  if (!r.sun_shadows) r.sun_shadows = other.sun_shadows;
  if (!r.levels) r.levels = other.levels;
  if (!r.pixel) r.pixel = other.pixel;
  if (!r.sky_directions) r.sky_directions = other.sky_directions;
  if (!r.mb) r.mb = other.mb;
  if (!r.far_ground) r.far_ground = other.far_ground;
  if (!r.ground_pixel) r.ground_pixel = other.ground_pixel;
  return r;
}

void MaskRequest::check(const FileLoc& loc, const std::array<std::string_view, 7>& names) const {
  const auto fail = [&](int name, const std::string& value, const std::string& expected) {
    throw InputError(loc, std::string(names[size_t(name)]) + " is " + value + ", expected " + expected);
  };
  if (sun_shadows &&
      std::find(std::begin(sun_shadow_names), std::end(sun_shadow_names), *sun_shadows) == std::end(sun_shadow_names))
    fail(0, "\"" + *sun_shadows + "\"", "one of: rays, masks");
  using forest::SlabResolution;
  if (levels && (*levels < SlabResolution::least_levels || *levels > SlabResolution::most_levels))
    fail(1, shown(*levels),
         "a number from " + shown(SlabResolution::least_levels) + " to " + shown(SlabResolution::most_levels));
  if (pixel && !(*pixel > 0 && *pixel <= widest_pixel)) fail(2, shown(*pixel), "metres above 0");
  if (sky_directions && (*sky_directions < 0 || *sky_directions > forest::MaskVisibility::most_sky_directions))
    fail(3, shown(*sky_directions), "a number from 0 to " + shown(forest::MaskVisibility::most_sky_directions));
  if (mb && !(*mb > 0 && *mb <= most_mb)) fail(4, shown(*mb), "MB above 0, to 1000000");
  if (far_ground && !(*far_ground >= 0 && *far_ground <= farthest)) fail(5, shown(*far_ground), "metres, 0 or more");
  if (ground_pixel && !(*ground_pixel >= 0 && *ground_pixel <= widest_pixel))
    fail(6, shown(*ground_pixel), "metres, 0 or more");
}

std::shared_ptr<const forest::MaskVisibility> make_masks(const scene::Scene& scene, const MaskRequest& request) {
  if (request.sun_shadows.value_or("rays") != "masks") return nullptr;
  if (const std::string why = obstacle_of_media(scene); !why.empty()) {
    log_warning("shadow masks have no effect: " + why);
    return nullptr;
  }
  const std::vector<emitters::NarrowBeam> beams = vegetation::narrow_beams(scene);
  forest::MaskVisibility::Settings s;
  s.sky_directions = request.sky_directions.value_or(0);
  if (beams.empty() && s.sky_directions == 0) {
    log_warning("shadow masks have no effect: the scene has no sun (a distant light, or one of type sky or canopy)");
    return nullptr;
  }
  s.sun.levels = request.levels.value_or(s.sun.levels);
  s.sun.pitch = request.pixel.value_or(0);
  s.sky.levels = std::max(s.sun.levels / 4, forest::SlabResolution::least_levels);
  s.sky.pitch = s.sun.pitch * 4;
  s.max_bytes = size_t(double(request.mb.value_or(default_mb)) * (1 << 20));
  try {
    return std::make_shared<forest::MaskVisibility>(vegetation::make_mask_scene(scene, facet_bytes), beams, s);
  } catch (const std::invalid_argument& problem) {
    throw InputError({"shadow masks", 0, 0}, std::string(problem.what()) + " (--mask-pixel, --mask-levels)");
  }
}

std::shared_ptr<const forest::GroundVisibility> make_far_ground(const scene::Scene& scene, const MaskRequest& request,
                                                                std::shared_ptr<const forest::MaskVisibility> masks) {
  const float nearest = request.far_ground.value_or(0);
  if (!(nearest > 0)) return nullptr;
  if (const std::string why = obstacle_of_media(scene); !why.empty()) {
    log_warning("penumbras on far ground have no effect: " + why);
    return nullptr;
  }
  const Timer timer;
  forest::GroundLight light = vegetation::survey_ground(scene, {nearest, request.ground_pixel.value_or(0)});
  const auto& heights = light.height.values;
  if (std::all_of(heights.begin(), heights.end(), [](float h) { return std::isnan(h); }) || light.empty()) {
    log_warning(
        "penumbras on far ground have no effect: no ground with anything above it (z up), or neither sun nor sky");
    return nullptr;
  }
  log_info(fmt::format("far ground: {} x {} pixels, {} suns{}, {:.1f} MB, {:.2f} s", light.height.width,
                       light.height.height, light.beams.size(), light.sky.values.empty() ? "" : " and the sky",
                       double(light.bytes()) / (1 << 20), timer.seconds()));
  return std::make_shared<forest::GroundVisibility>(std::move(light), std::move(masks));
}

}  // namespace dapple::build
