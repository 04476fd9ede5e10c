// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <optional>

#include "dapple/build/scene_builder.h"
#include "dapple/render/output.h"
#include "render_options.h"

namespace dapple::app {

/// Denoising in `dapple render`: whether, with which weights, and what the image's header says of it.
class FrameDenoising {
 public:
  /// Loads the weights, before any work. Where option or scene ask for denoising: IoError without weights. Where a
  /// preset would have it: a warning, and the image stays as it is rendered. UsageError where there is no image to
  /// denoise.
  FrameDenoising(const RenderOptions& o, const build::IntegratorRequest& request);

  /// The pixels to render: those of `crop` and, where the image is to be denoised, a border around them.
  Box2i rendered(const Box2i& crop, const V2i& resolution) const;
  /// What the network wants to know of the scene, and AOVs albedo and normal, go to output->features; AOV motion goes
  /// to output->motion.
  void trace_features(const scene::Scene& scene, const scene::Film::Settings& film, int samples, uint32_t pixel_samples,
                      uint64_t seed, render::OutputSettings* output);
  /// The film without its noise goes to output->denoised; `independent`: FrameDenoiser. If `interrupted` is set, or
  /// becomes so, the image stays as it is, which is said.
  void denoise(const scene::Film& film, bool independent, const std::atomic<bool>& interrupted,
               render::OutputSettings* output);

  bool is_on() const { return denoiser_.has_value(); }
  double feature_seconds() const { return feature_seconds_; }
  double seconds() const { return seconds_; }  ///< of the network

 private:
  std::optional<render::FrameDenoiser> denoiser_;
  float exposure_ = 0;  ///< 0: the frame's own
  bool weights_missing_ = false;
  double feature_seconds_ = 0, seconds_ = 0;
};

}  // namespace dapple::app
