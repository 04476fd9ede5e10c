// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/integrator_factory.h"

#include <algorithm>

#include "dapple/base/log.h"
#include "dapple/build/leaf_answers.h"
#include "dapple/distribution/cache_numbers.h"
#include "dapple/distribution/distribution_integrator.h"
#include "dapple/integrate/noise_probe.h"
#include "dapple/path/ambient_occlusion.h"
#include "dapple/path/path_integrator.h"

namespace dapple::build {

using distribution::VisiblePoints;

namespace {

constexpr int least_hemisphere = 64;  // diffuse rays, from which interpolation pays where nobody asked for it

// Something was asked for that speaks of the points of grids.
bool asks_for_grids(const IntegratorRequest& r) {
  return r.shadow_rays || r.diffuse_rays || r.shading_rate || r.pixel_points || r.irradiance_interpolation ||
         r.irradiance_accuracy;
}

std::shared_ptr<const vegetation::CanopyTransport> make_canopy(const scene::Scene& scene, const IntegratorRequest& r) {
  try {
    return solve_canopy(scene, r);
  } catch (const std::invalid_argument& problem) {
    throw InputError(FileLoc{r.place, 0, 0},
                     "integrator \"" + r.type + "\": " + std::string(problem.what()) + "; expected leaves");
  }
}

// Of textures, for so many samples a pixel.
float footprint_scale(int pixel_samples) {
  return std::max(0.125f, 1 / std::sqrt(float(pixel_samples)));
}

// Of all caches of view-independent results.
size_t cache_bytes(const IntegratorRequest& r) {
  return size_t(double(*r.cache_mb) * (1 << 20));
}

bool wants_opacity_cache(const scene::Scene& scene, const IntegratorRequest& r) {
  return *r.opacity_cache && gi::OpacityCache::has_use(scene);
}

size_t opacity_bytes(const scene::Scene& scene, const IntegratorRequest& r) {
  return wants_opacity_cache(scene, r) ? cache_bytes(r) / 8 : 0;
}

// Path tracing of what `s` asks for.
path::PathIntegrator::Settings path_settings(const distribution::DistributionIntegrator::Settings& s) {
  path::PathIntegrator::Settings p;
  p.diffuse_bounces = s.shading.bounces;
  p.specular_depth = s.shading.specular_depth;
  p.seed = s.shading.seed;
  p.texture_footprint = footprint_scale(s.pixel_samples);
  p.masks = s.masks;
  p.far_ground = s.far_ground;
  p.shafts = s.shading.shafts;
  p.learned_lights = s.shading.learned_lights;
  return p;
}

// A few hundredths of the image's work: each of their points sends some twenty rays.
int learning_paths(const scene::Scene& scene, int pixel_samples) {
  constexpr double least = 512, most = 32768, part = 1.0 / 256, most_part = 1.0 / 64;
  const V2i film = scene.camera.settings().resolution;
  const double samples = double(film.x) * film.y * pixel_samples;
  return int(std::min(std::clamp(samples * part, least, most), samples * most_part));
}

}  // namespace

std::unique_ptr<gi::OpacityCache> make_opacity_cache(scene::Scene& scene, const IntegratorRequest& asked) {
  const IntegratorRequest r = asked.over(preset_request(asked.preset));
  return wants_opacity_cache(scene, r) ? std::make_unique<gi::OpacityCache>(scene, opacity_bytes(scene, r)) : nullptr;
}

namespace {

std::unique_ptr<const integrate::Integrator> make_paths(const scene::Scene& scene, const IntegratorRequest& asked,
                                                        int samples, uint64_t seed, StopToken stop,
                                                        Preparations* known) {
  path::PathIntegrator::Settings s;
  s.seed = seed;
  s.stop = stop;
  s.specular_depth = asked.specular_depth.value_or(s.specular_depth);
  if (asked.type != "path") {
    s.diffuse_bounces = asked.bounces.value_or(0);
    s.canopy = make_canopy(scene, asked);
    s.canopy_gather = asked.canopy_gather.value_or(asked.type == "canopy");
  } else if (asked.bounces) {
    s.diffuse_bounces = *asked.bounces;
  } else {
    s.max_scatterings = asked.max_depth.value_or(default_max_depth);
    s.diffuse_bounces = s.specular_depth = s.max_scatterings;
  }
  s.texture_footprint = footprint_scale(samples);
  s.masks = make_masks(scene, asked.masks);
  s.far_ground = make_far_ground(scene, asked.masks, s.masks);
  ShaftRequest shafts = asked.shafts;
  if (asked.type == "images" && scene.has_media()) shafts.scattering = "single";  // they follow no flights
  s.shafts = make_shafts(scene, shafts, asked.type == "canopy" || (asked.type == "images" && scene.has_media()), seed);
  if (asked.type == "images") return make_image_integrator(scene, s, asked.images, asked.place);
  if (asked.light_learning.value_or(true)) s.learning_paths = learning_paths(scene, samples);
  if (known) s.light_points = known->light_points;
  auto made = std::make_unique<path::PathIntegrator>(scene, s);
  if (auto points = made->take_light_points(); points && known) known->light_points = std::move(points);
  if (asked.type != "path" || !asked.leaf_answers.value_or(false)) return made;
  s.leaf_answers = make_leaf_answers(scene, asked, *made, samples, stop);
  if (!s.leaf_answers) return made;
  s.learning_paths = 0;
  s.learned_lights = made->learned_lights();
  return std::make_unique<path::PathIntegrator>(scene, s);
}

std::shared_ptr<const emitters::LearnedLights> learn_lights(const scene::Scene& scene,
                                                            const distribution::DistributionIntegrator::Settings& s,
                                                            int samples, Preparations* known) {
  path::PathIntegrator::Settings p;
  p.diffuse_bounces = std::max(s.shading.bounces, 1);
  p.seed = s.shading.seed;
  p.stop = s.stop;
  p.masks = s.masks;
  p.far_ground = s.far_ground;
  p.learning_paths = learning_paths(scene, samples);
  if (known) p.light_points = known->light_points;
  path::PathIntegrator paths(scene, p);
  if (auto points = paths.take_light_points(); points && known) known->light_points = std::move(points);
  return paths.learned_lights();
}

// Whether cells of the cache save more than they cost in what is not for `others`; where that is not certain they are
// read.
bool takes_noise_away(const scene::Scene& scene, const path::PathIntegrator& cached, const path::PathIntegrator& alone,
                      const std::vector<uint8_t>& others, const distribution::DistributionSettings& s) {
  scene::Film::Settings film;  // of the camera for which surfaces are diced, whatever is seen
  film.resolution = scene.camera.settings().resolution;
  film.signed_weights = scene.film.signed_weights;
  const integrate::NoiseProbe probe(film, s.pixel_samples);
  if (probe.has_too_few_boxes()) return true;
  const integrate::PathsAlone by_cells(scene, cached, others, s.shading.seed),
      by_rays(scene, alone, others, s.shading.seed);
  const integrate::NoiseProbe::Ratio ratio = probe.variance_ratio(by_cells, by_rays, s.stop);
  return ratio.value - ratio.error <= 1 - double(distribution::CacheNumbers::least_removed);
}

// Paths for the camera samples of `grids`, of such settings, that end where it pays: in its answers, in leaves, in both
// or nowhere. `answers`: its own; `asked`: whether paths end in them; empty: where that pays.
std::unique_ptr<const path::PathIntegrator> make_camera_paths(
    const scene::Scene& scene, const distribution::DistributionSettings& s, const IntegratorRequest& r,
    const distribution::DistributionIntegrator& grids, std::shared_ptr<const integrate::RadiosityAnswers> answers,
    const std::optional<bool>& asked) {
  path::PathIntegrator::Settings p = path_settings(s);
  auto alone = std::make_unique<path::PathIntegrator>(scene, p);
  const auto ended_in_leaves = [&] {
    path::PathIntegrator::Settings ended = path_settings(s);
    ended.leaf_answers = make_leaf_answers(scene, r, *alone, s.pixel_samples, s.stop);
    return ended.leaf_answers ? std::make_unique<path::PathIntegrator>(scene, ended) : std::move(alone);
  };
  if (!asked && grids.answered() < distribution::CacheNumbers::least_answered) return ended_in_leaves();
  const bool ends = r.leaf_answers.value_or(false);
  if (ends) alone = ended_in_leaves();
  p.leaf_answers = alone->leaf_answers();
  p.radiosity = std::move(answers);
  auto cached = std::make_unique<path::PathIntegrator>(scene, p);
  if (asked || takes_noise_away(scene, *cached, *alone, grids.not_for_paths(), s)) return cached;
  if (ends) return alone;
  return ended_in_leaves();
}

}  // namespace

std::unique_ptr<const integrate::Integrator> make_integrator(const scene::Scene& scene, const IntegratorRequest& asked,
                                                             int pixel_samples, uint64_t seed, StopToken stop,
                                                             Preparations* known) {
  const IntegratorRequest preset = preset_request(asked.preset);
  const int samples = pixel_samples > 0 ? pixel_samples : asked.pixel_samples.value_or(*preset.pixel_samples);
  if (asked.type == "path" || asked.type == "canopy" || asked.type == "images")
    return make_paths(scene, asked, samples, seed, stop, known);
  const IntegratorRequest r = asked.over(preset);
  if (r.type == "ao") {
    path::AmbientOcclusion::Settings s;
    s.seed = seed;
    s.rays = (r.diffuse_rays->at(0) + samples - 1) / samples;
    s.max_distance = r.max_distance.value_or(infinity);
    s.color_bleeding = *r.color_bleeding;
    return std::make_unique<path::AmbientOcclusion>(scene, s);
  }
  for (const auto& [name, depth] : {std::pair{"bounces", r.bounces.value_or(0)}, {"specular depth", *r.specular_depth}})
    if (depth > max_depth_followed)
      throw UsageError("distribution ray tracing follows at most " + std::to_string(max_depth_followed) +
                       " scatterings of a kind; " + name + " " + std::to_string(depth) + " is for the path integrator");
  distribution::DistributionIntegrator::Settings s;
  s.stop = stop;
  s.shading.seed = seed;
  s.shading.specular_depth = *r.specular_depth;
  // Unlimited bounces, as many scenes ask for by a large maxdepth, would be a tree of that depth.
  s.shading.bounces = r.bounces ? *r.bounces : std::clamp(*r.max_depth - 1, 0, *preset.bounces);
  s.shading.shadow_rays = *r.shadow_rays;
  s.shading.diffuse_rays = *r.diffuse_rays;
  s.shading.subsurface_rays = *r.subsurface_rays;
  s.pixel_samples = samples;
  if (pixel_samples > 0) s.max_pixel_samples = r.max_pixel_samples.value_or(0);
  s.visible_points =
      asked.visible_points.value_or(asks_for_grids(asked) ? VisiblePoints::grids : *preset.visible_points);
  s.shading_rate = *r.shading_rate;
  s.pixel_points = *r.pixel_points;
  s.radiosity_cache = *r.radiosity_cache;
  s.shading.caustics = *r.caustics;
  s.subsurface_cache = *r.subsurface_cache;
  s.shading.cache_width = *r.cache_width;
  const bool pays = !asked.diffuse_rays || asked.diffuse_rays->at(0) >= least_hemisphere;
  s.irradiance_interpolation = asked.irradiance_interpolation.value_or(pays);
  s.irradiance_accuracy = *r.irradiance_accuracy;
  s.cache_bytes = cache_bytes(r) - opacity_bytes(scene, r);
  s.light_groups = r.light_groups;
  s.log_caches = r.log_caches;
  s.masks = make_masks(scene, r.masks);
  s.far_ground = make_far_ground(scene, r.masks, s.masks);
  s.shading.shafts = make_shafts(scene, r.shafts, true, seed);
  if (r.light_learning.value_or(true) && light::DirectLight::pays_to_learn(scene))
    s.shading.learned_lights = learn_lights(scene, s, samples, known);
  if (known) s.readers = known->readers;
  auto made = std::make_unique<distribution::DistributionIntegrator>(scene, s);
  if (known) known->readers = made->readers();
  const integrate::RadiosityAnswers* const answers = made->answers();
  if (!answers) {
    if (r.leaf_answers.value_or(false))
      log_warning("canopy answers: surfaces are shaded on grids here, and only paths end in leaves");
    return made;
  }
  const std::vector<uint8_t>& others = made->not_for_paths();
  if (std::any_of(others.begin(), others.end(), [](uint8_t other) { return other; })) {
    // What holds the paths is not held by them.
    made->set_paths(make_camera_paths(scene, s, r, *made, {std::shared_ptr<void>(), answers}, asked.radiosity_cache));
    return made;
  }
  const std::shared_ptr<const distribution::DistributionIntegrator> kept = std::move(made);
  return make_camera_paths(scene, s, r, *kept, {kept, answers}, asked.radiosity_cache);
}

}  // namespace dapple::build
