// SPDX-License-Identifier: Apache-2.0
#include "frame_denoising.h"

#include <algorithm>

#include "dapple/base/log.h"
#include "dapple/base/timer.h"

namespace dapple::app {

namespace {

// Of albedo and normals: the network cleans what is left of their noise. More than the image has would show edges that
// it has not.
constexpr int most_samples = 16;

// Pixels around a crop; of those on its left and above a few more, since the network pools by 16: a crop must begin as
// the whole frame does. Differences from the whole, as displayed, are then .06 % (bedroom, 240 x 135); .15 % with 16,
// 1 % without, and .36 % where pools are shifted.
constexpr int border = 32, pooled = 16;

bool wanted(const std::vector<std::string>& aovs) {
  return std::any_of(aovs.begin(), aovs.end(),
                     [](const std::string& aov) { return aov == "albedo" || aov == "normal"; });
}

}  // namespace

FrameDenoising::FrameDenoising(const RenderOptions& o, const build::IntegratorRequest& request) {
  const bool asked = request.denoise.has_value();
  const bool preset =
      request.type == "distribution" && *build::preset_request(request.preset).denoise && o.show_cache.empty();
  const bool on = asked ? *request.denoise : preset;
  exposure_ = o.denoise_exposure;
  if (!on && exposure_ > 0) log_warning("--denoise-exposure has no effect without --denoise on");
  if (!on && !o.denoise_weights.empty()) log_warning("--denoise-weights has no effect without --denoise on");
  if (!on) return;
  if (!o.show_cache.empty()) throw UsageError("--denoise on goes with images, not with the pictures of --show-cache");
  if (!o.denoise_weights.empty()) {
    denoiser_.emplace(o.denoise_weights);
  } else if (asked || !denoise::find_weights(denoise::feature_weights).empty()) {
    denoiser_.emplace();
  } else {
    weights_missing_ = true;
    log_warning("the image is not denoised, as preset " + (request.preset.empty() ? "preview" : request.preset) +
                " would have it: the weights \"" + std::string(denoise::feature_weights) +
                "\" are missing; expected them in $DAPPLE_WEIGHTS, or in share/dapple/denoise above the program");
  }
}

Box2i FrameDenoising::rendered(const Box2i& crop, const V2i& resolution) const {
  if (!denoiser_) return crop;
  const auto begin = [](int at) { return std::max(0, at - border) / pooled * pooled; };
  return {V2i(begin(crop.min.x), begin(crop.min.y)),
          V2i(std::min(resolution.x, crop.max.x + border), std::min(resolution.y, crop.max.y + border))};
}

void FrameDenoising::trace_features(const scene::Scene& scene, const scene::Film::Settings& film, int samples,
                                    uint32_t pixel_samples, uint64_t seed, render::OutputSettings* output) {
  const Timer timer;
  const integrate::FeatureTracer::Settings settings{std::clamp(samples, 1, most_samples), seed, pixel_samples};
  if ((denoiser_ && denoiser_->wants_features()) || wanted(output->aovs))
    output->features = render::trace_features(scene, film.crop, settings);
  if (render::show_motion(output->aovs)) output->motion = render::trace_motion(scene, film.crop, settings);
  feature_seconds_ = timer.seconds();
}

void FrameDenoising::denoise(const scene::Film& film, bool independent, const std::atomic<bool>& interrupted,
                             render::OutputSettings* output) {
  const auto say = [&](const std::string& text) { output->metadata.push_back({"dapple/denoised", text}); };
  if (!denoiser_) return say(weights_missing_ ? "no: the weights are missing" : "no");
  const Timer timer;
  try {
    const StopToken stop(interrupted);
    stop.check();
    output->denoised = (*denoiser_)(film, output->features ? &*output->features : nullptr,
                                    {.light_groups = int(output->light_groups.size()),
                                     .exposure = exposure_,
                                     .independent = independent,
                                     .stop = stop});
    output->metadata.push_back({"dapple/denoiseExposure", output->denoised->exposure});
    const bool crop = output->window || film.settings().crop != Box2i(V2i(0, 0), film.settings().resolution);
    say("by " + denoiser_->description() +
        (crop ? "; a crop with " + std::to_string(border) +
                    " pixels around it, so that it may differ from the whole image"
              : ""));
  } catch (const Stopped&) {
    log_warning("interrupted: the image is not denoised");
    say("no: interrupted");
  }
  seconds_ = timer.seconds();
}

}  // namespace dapple::app
