// SPDX-License-Identifier: Apache-2.0
#include "dapple/render/picture.h"

#include <algorithm>

#include "dapple/base/error.h"
#include "dapple/base/log.h"
#include "dapple/denoise/weights.h"
#include "dapple/render/gains.h"

namespace dapple::render {

namespace {

// Of albedo and normals: the network cleans what is left of their noise.
constexpr int most_feature_samples = 16;

bool any_feature(const std::vector<std::string>& aovs) {
  return std::any_of(aovs.begin(), aovs.end(),
                     [](const std::string& aov) { return aov == "albedo" || aov == "normal"; });
}

bool wants_denoiser(const build::IntegratorRequest& r, const std::string& folder) {
  const bool asked = r.denoise.has_value();
  const bool on = asked ? *r.denoise : r.type == "distribution" && *build::preset_request(r.preset).denoise;
  if (!on) return false;
  if (asked || !denoise::find_weights(denoise::feature_weights, folder).empty()) return true;
  log_warning("the image is not denoised, as its preset would have it: the weights \"" +
              std::string(denoise::feature_weights) +
              "\" are missing; expected them in $DAPPLE_WEIGHTS, or in share/dapple/denoise above the program");
  return false;
}

StopRules make_rules(const PictureRequest& asked, const build::IntegratorRequest& settled) {
  StopRules rules;
  rules.time_limit = asked.time_limit;
  rules.noise_target = asked.noise_target;
  rules.pixel_noise = *settled.pixel_noise;
  if (!asked.integrator.pixel_samples && (asked.time_limit > 0 || asked.noise_target > 0)) {
    rules.pixel_samples = uint32_t(build::max_pixel_samples);
    return rules;
  }
  rules.pixel_samples = uint32_t(*settled.pixel_samples);
  rules.max_pixel_samples = uint32_t(settled.max_pixel_samples.value_or(0));
  return rules;
}

}  // namespace

Picture::~Picture() = default;

bool keeps_direct(const integrate::Integrator& integrator, const std::vector<std::string>& aovs, bool denoises) {
  if (show_direct(aovs) && !integrator.tells_direct())
    throw UsageError(
        "layer direct needs camera samples that are traced as paths, as path, canopy and the presets draft and "
        "preview of distribution do");
  return integrator.tells_direct() && (denoises || show_direct(aovs));
}

Picture::Picture(build::BuiltScene& built, const PictureRequest& asked, StopToken stop,
                 std::shared_ptr<const gi::OpacityCache> opacity)
    : built_(built), asked_(asked), request_(asked.integrator.over(built.request)), opacity_(std::move(opacity)) {
  request_.log_caches = show_cache_use(asked.aovs);
  if (request_.log_caches && (request_.type != "distribution" || !request_.radiosity_cache.value_or(true)))
    throw UsageError("layers cache_... need integrator distribution and its radiosity cache");
  if (asked.light_groups && request_.type != "path" && request_.type != "distribution")
    throw UsageError("light groups go with integrators path and distribution, not " + request_.type);
  const scene::LightGroups& groups = built.scene->light_groups;
  check_gains(built.scene.get(), groups.gains, {request_, asked.aovs, asked.noise_target});
  const bool may_mix =
      asked.mixes && groups.names.size() > 1 && (request_.type == "path" || request_.type == "distribution");
  request_.light_groups = asked.light_groups || groups.has_gains() || may_mix;
  if (request_.light_groups) film_groups_ = int(groups.names.size());
  if (wants_denoiser(request_, asked.weights_folder))
    denoiser_.emplace(denoise::weights_path(denoise::feature_weights, asked.weights_folder));
  const build::IntegratorRequest settled = request_.over(build::preset_request(request_.preset));
  rules_ = make_rules(asked, settled);
  seed_ = request_.seed.value_or(0);
  const bool open = rules_.pixel_samples == uint32_t(build::max_pixel_samples);
  if (!opacity_) opacity_ = build::make_opacity_cache(*built.scene, request_);
  integrator_ = build::make_integrator(built, request_, open ? 0 : int(rules_.pixel_samples), seed_, stop);
}

scene::Film Picture::make_film() const {
  scene::Film::Settings s = built_.scene->film;
  s.features = std::any_of(asked_.aovs.begin(), asked_.aovs.end(), from_film);
  s.light_groups = film_groups_;
  s.cache_use = request_.log_caches;
  s.direct = keeps_direct(*integrator_, asked_.aovs, denoises());
  s.air = show_air(asked_.aovs);
  scene::Film film(s);
  if (film_groups_ > 0) film.set_gains(built_.scene->light_groups.gains);
  return film;
}

bool Picture::keeps_for(const std::vector<RGB>& gains) const {
  return film_groups_ == int(gains.size()) ||
         std::all_of(gains.begin(), gains.end(), [](const RGB& gain) { return gain == RGB(1); });
}

integrate::CacheState Picture::opacity_state() const {
  return opacity_->state();
}

image::OutputImage Picture::layers(const scene::Film& film, bool denoise, StopToken stop, bool loops) {
  OutputSettings output;
  output.loops = loops;
  output.origin = built_.origin;
  output.aovs = asked_.aovs;
  if (asked_.light_groups) output.light_groups = built_.scene->light_groups.names;
  const bool network = denoise && denoiser_;
  const integrate::FeatureTracer::Settings samples{std::clamp(int(rules_.pixel_samples), 1, most_feature_samples),
                                                   seed_, std::max(rules_.pixel_samples, rules_.max_pixel_samples)};
  if ((network && denoiser_->wants_features()) || any_feature(asked_.aovs)) {
    if (!features_) features_ = trace_features(*built_.scene, film.settings().crop, samples, stop);
    output.features = features_;
  }
  if (show_motion(asked_.aovs)) {
    if (!motion_) motion_ = trace_motion(*built_.scene, film.settings().crop, samples, stop);
    output.motion = motion_;
  }
  if (network)
    output.denoised = (*denoiser_)(film, output.features ? &*output.features : nullptr,
                                   {.light_groups = int(output.light_groups.size()),
                                    .independent = integrator_->samples_are_independent(),
                                    .stop = stop});
  return make_output(film, output);
}

}  // namespace dapple::render
