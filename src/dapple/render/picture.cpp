// SPDX-License-Identifier: Apache-2.0
#include "dapple/render/picture.h"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "dapple/base/error.h"
#include "dapple/base/log.h"
#include "dapple/base/timer.h"
#include "dapple/denoise/error_estimate.h"
#include "dapple/denoise/weights.h"
#include "dapple/render/report.h"
#include "dapple/scene/camera_matrices.h"

namespace dapple::render {

namespace {

// Of albedo and normals: the network cleans what is left of their noise. More than the image has would show edges that
// it has not.
constexpr int most_feature_samples = 16;

// Pixels around a crop; of those on its left and above a few more, since the network pools by 16: a crop must begin as
// the whole frame does. Differences from the whole, as displayed, are then .06 % (bedroom, 240 x 135); .15 % with 16,
// 1 % without, and .36 % where pools are shifted.
constexpr int border = 32, pooled = 16;

bool any_feature(const std::vector<std::string>& aovs) {
  return std::any_of(aovs.begin(), aovs.end(),
                     [](const std::string& aov) { return aov == "albedo" || aov == "normal"; });
}

std::vector<std::string> aovs_of(const build::BuiltScene& built, const PictureRequest& asked) {
  std::vector<std::string> aovs = asked.aovs;
  if (aovs.empty() && built.film.gbuffer) aovs = aov_names();
  if (asked.cache_view)
    for (const std::string& aov : cache_aov_names())
      if (std::find(aovs.begin(), aovs.end(), aov) == aovs.end()) aovs.push_back(aov);
  return aovs;
}

/// By the request, else by the preset.
bool wants_denoiser(const build::IntegratorRequest& r, const PictureRequest& asked) {
  if (r.denoise.value_or(false) && asked.cache_view)
    throw UsageError("denoising goes with images, not with the pictures of --show-cache");
  if (r.denoise) return *r.denoise;
  return r.type == "distribution" && *build::preset_request(r.preset).denoise && !asked.cache_view;
}

StopRules make_rules(const PictureRequest& asked, const build::IntegratorRequest& settled) {
  const std::optional<int>& most = asked.integrator.max_pixel_samples;
  StopRules rules;
  rules.time_limit = asked.time_limit;
  rules.noise_target = asked.noise_target;
  rules.pixel_noise = *settled.pixel_noise;
  if (!asked.integrator.pixel_samples && (asked.time_limit > 0 || asked.noise_target > 0)) {
    if (most) throw UsageError("--max-pixel-samples with a limit of time or noise needs --pixel-samples");
    rules.pixel_samples = uint32_t(build::max_pixel_samples);
  } else {
    rules.pixel_samples = uint32_t(*settled.pixel_samples);
    rules.max_pixel_samples = uint32_t(settled.max_pixel_samples.value_or(0));
    if (most && rules.max_pixel_samples < rules.pixel_samples)
      throw UsageError("--max-pixel-samples is below the " + std::to_string(rules.pixel_samples) +
                       " camera samples that each pixel gets");
  }
  if (asked.integrator.pixel_noise && rules.max_pixel_samples <= rules.pixel_samples)
    throw UsageError("--pixel-noise needs --max-pixel-samples, and those above --pixel-samples");
  return rules;
}

/// A matrix for row vectors, from the coordinates of the scene file.
M44f from_file(const M44f& m, const V3d& origin) {
  M44d shift;
  shift.setTranslation(-origin);
  return M44f(shift * M44d(m));
}

}  // namespace

Picture::~Picture() = default;

build::IntegratorRequest settled_request(const build::BuiltScene& built, const PictureRequest& asked) {
  const std::vector<std::string> aovs = aovs_of(built, asked);
  build::IntegratorRequest r = asked.integrator.over(built.request);
  r.log_caches = show_cache_use(aovs);
  if (r.log_caches && (r.type != "distribution" || !r.radiosity_cache.value_or(true)))
    throw UsageError(std::string(asked.cache_view ? "--show-cache needs" : "layers cache_... need") +
                     " integrator distribution and its radiosity cache");
  const bool keeps_groups = r.type == "path" || r.type == "distribution";
  if (asked.light_groups && !keeps_groups)
    throw UsageError("light groups go with integrators path and distribution, not " + r.type);
  const scene::LightGroups& groups = built.scene->light_groups;
  check_gains(groups.gains, {r, aovs, asked.noise_target});
  r.light_groups = asked.light_groups || groups.has_gains() || (asked.mixes && groups.names.size() > 1 && keeps_groups);
  return r;
}

bool keeps_direct(const integrate::Integrator& integrator, const std::vector<std::string>& aovs, bool denoises) {
  if (show_direct(aovs) && !integrator.tells_all_direct())
    throw UsageError(
        "layer direct needs camera samples that are all traced as paths, as path, canopy and, without subsurface "
        "bodies and dear shaders, the presets draft and preview of distribution do");
  return integrator.tells_direct() && (denoises || show_direct(aovs));
}

Picture::Picture(build::BuiltScene& built, const PictureRequest& asked, StopToken stop,
                 std::shared_ptr<const gi::OpacityCache> opacity, build::Preparations* known)
    : built_(built),
      asked_(asked),
      aovs_(aovs_of(built, asked)),
      request_(settled_request(built, asked)),
      opacity_(std::move(opacity)) {
  if (request_.light_groups) film_groups_ = int(built.scene->light_groups.names.size());
  rules_ = make_rules(asked, request_.over(build::preset_request(request_.preset)));
  if (wants_denoiser(request_, asked)) {
    if (!asked.weights.empty()) {
      denoiser_.emplace(asked.weights);
    } else if (request_.denoise || !denoise::find_weights(denoise::feature_weights, asked.weights_folder).empty()) {
      denoiser_.emplace(denoise::weights_path(denoise::feature_weights, asked.weights_folder));
    } else {
      lacks_weights_ = true;
      log_warning("the image is not denoised, as preset " + (request_.preset.empty() ? "preview" : request_.preset) +
                  " would have it: the weights \"" + std::string(denoise::feature_weights) +
                  "\" are missing; expected them in $DAPPLE_WEIGHTS, or in share/dapple/denoise above the program");
    }
  }
  seed_ = request_.seed.value_or(0);
  const bool open = rules_.pixel_samples == uint32_t(build::max_pixel_samples);
  if (!opacity_) opacity_ = build::make_opacity_cache(*built.scene, request_);
  integrator_ = build::make_integrator(built, request_, open ? 0 : int(rules_.pixel_samples), seed_, stop, known);
}

Box2i Picture::rendered_crop() const {
  const V2i resolution = built_.scene->film.resolution;
  const Box2i& crop = built_.scene->film.crop;
  if (!denoiser_ && !show_error(aovs_)) return crop;
  const int around = denoiser_ ? border : denoise::smooth_radius, step = denoiser_ ? pooled : 1;
  const auto begin = [&](int at) { return std::max(0, at - around) / step * step; };
  return {V2i(begin(crop.min.x), begin(crop.min.y)),
          V2i(std::min(resolution.x, crop.max.x + around), std::min(resolution.y, crop.max.y + around))};
}

scene::Film Picture::make_film() const {
  scene::Film::Settings s = built_.scene->film;
  s.crop = rendered_crop();
  s.features = std::any_of(aovs_.begin(), aovs_.end(), from_film);
  s.light_groups = film_groups_;
  s.cache_use = request_.log_caches;
  s.direct = keeps_direct(*integrator_, aovs_, denoises());
  s.air = show_air(aovs_);
  s.halves = denoiser_ && (judges_denoised() || show_error(aovs_));
  scene::Film film(s);
  if (film_groups_ > 0) film.set_gains(built_.scene->light_groups.gains);
  return film;
}

GainReach Picture::reach_of(const std::vector<RGB>& gains) const {
  const bool all_one = std::all_of(gains.begin(), gains.end(), [](const RGB& gain) { return gain == RGB(1); });
  if (film_groups_ != int(gains.size()) && !all_one) return GainReach::stored;
  return gains == built_.scene->light_groups.gains ? GainReach::sums : reach_of_gains(*built_.scene, request_.type);
}

bool Picture::weighs_gains() const {
  return film_groups_ > 0 && reach_of_gains(*built_.scene, request_.type) == GainReach::sums;
}

integrate::CacheState Picture::opacity_state() const {
  return opacity_->state();
}

void Picture::trace_features(StopToken stop) {
  const Timer timer;
  const integrate::FeatureTracer::Settings settings{std::clamp(int(rules_.pixel_samples), 1, most_feature_samples),
                                                    seed_, std::max(rules_.pixel_samples, rules_.max_pixel_samples)};
  if (!features_ && ((denoiser_ && denoiser_->wants_features()) || any_feature(aovs_)))
    features_ = render::trace_features(*built_.scene, rendered_crop(), settings, stop);
  if (!motion_ && show_motion(aovs_)) trace_motion(settings, stop);
  feature_seconds_ += timer.seconds();
}

void Picture::trace_motion(const integrate::FeatureTracer::Settings& settings, StopToken stop) {
  const scene::Scene& scene = *built_.scene;
  const auto to = [&](const build::BuiltScene* frame, int frames) {
    if (!frame) return render::trace_motion(scene, rendered_crop(), settings, stop);
    const integrate::NeighbourScene neighbour{
        *frame->scene, frames, built_.origin - frame->origin, {scene.traced, frame->scene->traced}};
    const size_t shapes = neighbour.same.lost_shapes(), instances = neighbour.same.lost_instances();
    if (shapes + instances > 0)
      log_warning(std::string(frames > 0 ? "--next" : "--previous") + ": " + std::to_string(shapes) + " shapes and " +
                  std::to_string(instances) +
                  " instances of this frame have no counterpart there; their motion is that while the shutter is open");
    return render::trace_motion(scene, rendered_crop(), settings, stop, &neighbour);
  };
  image::Image forwards = to(asked_.next, 1);
  if (asked_.previous) motion_back_ = to(asked_.previous, -1);
  motion_ = std::move(forwards);
}

bool Picture::judges_denoised() const {
  return denoiser_ && (rules_.noise_target > 0 || rules_.max_pixel_samples > rules_.pixel_samples);
}

FrameDenoiser::Options Picture::denoising(bool estimates_error, int light_groups, StopToken stop) const {
  return {.light_groups = light_groups,
          .exposure = asked_.denoise_exposure,
          .independent = integrator_->samples_are_independent(),
          .estimates_error = estimates_error,
          .stop = stop};
}

void Picture::judge(RenderSession& session, const scene::Film& film) {
  if (!judges_denoised()) return;
  session.judge_by([this, &film](StopToken stop) {
    trace_features(stop);
    if (film.has_gains()) return std::vector<float>();  // which may have come meanwhile
    const DenoisedFrame frame = (*denoiser_)(film, features_ ? &*features_ : nullptr, denoising(true, 0, stop));
    return std::vector<float>(frame.relative_square.pixels().begin(), frame.relative_square.pixels().end());
  });
}

image::OutputImage Picture::layers(const scene::Film& film, bool denoise, StopToken stop, bool loops) {
  OutputSettings output;
  output.loops = loops;
  output.origin = built_.origin;
  output.aovs = aovs_;
  output.cache_view = asked_.cache_view;
  if (film.settings().crop != built_.scene->film.crop) output.window = built_.scene->film.crop;
  if (asked_.light_groups) output.light_groups = built_.scene->light_groups.names;
  const bool network = denoise && denoiser_;
  if (network || any_feature(aovs_) || show_motion(aovs_)) trace_features(stop);
  if (any_feature(aovs_)) output.features = features_;
  output.motion = motion_, output.motion_back = motion_back_;
  const Timer timer;
  if (network)
    output.denoised = (*denoiser_)(film, features_ ? &*features_ : nullptr,
                                   denoising(show_error(aovs_), int(output.light_groups.size()), stop));
  if (show_error(aovs_)) output.error = standard_errors(film, output.denoised ? &*output.denoised : nullptr, loops);
  denoise_seconds_ = network ? timer.seconds() : 0;
  add_header(&output);
  return make_output(film, output);
}

std::string Picture::denoising_text(bool denoised) const {
  if (lacks_weights_) return "no: the weights are missing";
  if (!denoised) return "no";
  const scene::Film::Settings& film = built_.scene->film;
  const bool crop = film.crop != Box2i(V2i(0, 0), film.resolution);
  return "by " + denoiser_->description() +
         (crop ? "; a crop with " + std::to_string(border) +
                     " pixels around it, so that it may differ from the whole image"
               : "");
}

void Picture::add_header(OutputSettings* output) const {
  auto& header = output->metadata;
  for (auto& line : scene_header(built_, seed_)) header.push_back(std::move(line));
  header.push_back({"dapple/denoised", denoising_text(output->denoised.has_value())});
  if (output->denoised) header.push_back({"dapple/denoiseExposure", output->denoised->exposure});
  if (integrator_->samples_are_independent()) header.push_back({"dapple/independentSamples", 1});
  if (show_motion(aovs_) && scene::camera_matrices(built_.scene->camera).world_to_ndc) add_cameras_of_motion(output);
}

// That of the next frame stands where else the camera is whose motion goes on as far as there.
void Picture::add_cameras_of_motion(OutputSettings* output) const {
  const scene::Camera& here = built_.scene->camera;
  const auto add = [&](const char* name, const std::optional<M44f>& matrix, const V3d& origin) {
    if (matrix) output->metadata.push_back({name, from_file(*matrix, origin)});
  };
  output->metadata.push_back({"dapple/shuttersAFrame", asked_.next ? 1.0f : here.shutters_a_frame()});
  if (asked_.next)
    add("dapple/worldToNDCAtClose", scene::camera_matrices(asked_.next->scene->camera).world_to_ndc,
        asked_.next->origin);
  else
    add("dapple/worldToNDCAtClose", scene::camera_matrices_at_close(here).world_to_ndc, built_.origin);
  if (asked_.previous)
    add("dapple/worldToNDCOfPrevious", scene::camera_matrices(asked_.previous->scene->camera).world_to_ndc,
        asked_.previous->origin);
}

std::vector<std::pair<std::string, image::MetadataValue>> scene_header(const build::BuiltScene& built, uint64_t seed) {
  char fingerprint[17];
  std::snprintf(fingerprint, sizeof fingerprint, "%016llx", static_cast<unsigned long long>(built.scene->fingerprint));
  std::vector<std::pair<std::string, image::MetadataValue>> header = {
      {"Software", "Dapple " + version()},
      {"dapple/sceneFingerprint", std::string(fingerprint)},
      {"dapple/seed", std::to_string(seed)}};
  const scene::CameraMatrices camera = scene::camera_matrices(built.scene->camera);
  header.push_back({"worldToCamera", from_file(camera.world_to_camera, built.origin)});
  if (camera.world_to_ndc) header.push_back({"worldToNDC", from_file(*camera.world_to_ndc, built.origin)});
  return header;
}

void add_to_header(const SessionResult& result, image::OutputImage* picture) {
  picture->metadata.push_back({"dapple/samples", int(result.samples)});
  picture->metadata.push_back({"dapple/renderSeconds", float(result.seconds)});
}

}  // namespace dapple::render
