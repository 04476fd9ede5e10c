// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "dapple/base/stop_token.h"
#include "dapple/denoise/denoiser.h"
#include "dapple/denoise/weights.h"
#include "dapple/image/image.h"
#include "dapple/integrate/motion_tracer.h"
#include "dapple/scene/film.h"

namespace dapple::render {

/// Albedo and normals of the film's crop (integrate::FeatureTracer), as images of three channels. May throw Stopped.
struct FeatureLayers {
  image::Image albedo, normal;
};
FeatureLayers trace_features(const scene::Scene& scene, const Box2i& crop,
                             const integrate::FeatureTracer::Settings& settings, StopToken stop = {});

/// How what is seen moves to the next frame, as an image of three channels (integrate::MotionTracer): to that of `to`
/// where it is not null. May throw Stopped.
image::Image trace_motion(const scene::Scene& scene, const Box2i& crop,
                          const integrate::FeatureTracer::Settings& settings, StopToken stop = {},
                          const integrate::NeighbourScene* to = nullptr);

/// A frame without its noise, over the film's crop.
struct DenoisedFrame {
  image::Image colour;
  std::vector<image::Image> light_groups;  ///< of which colour is the sum
  float exposure = 1;                      ///< that the network took colour with
  /// Squared errors of colour's pixels (denoise::relative_error) and these relative to their light, one channel each,
  /// where they were asked for; infinite below denoise::least_samples_for_error.
  image::Image squared_error, relative_square;
};

/// AOV error: standard errors of a film's pixels (denoise::smooth_variance), infinite where they are not known, or of
/// those that were denoised with an estimate of the error. Without `loops` no loop runs in parallel.
image::Image standard_errors(const scene::Film& film, const DenoisedFrame* denoised, bool loops);

/// Denoises films: a pure function of film and layers.
class FrameDenoiser {
 public:
  /// Errors as denoise::Denoiser; IoError where the default ones are missing.
  explicit FrameDenoiser(const std::string& weights = denoise::weights_path(denoise::feature_weights));

  bool wants_features() const { return denoiser_.inputs() > 3; }
  std::string description() const { return denoiser_.description(); }
  struct Options {
    int light_groups = 0;          ///< the first of the film, all or none
    float exposure = 0;            ///< 0: denoise::auto_exposure() of the film
    bool independent = false;      ///< Integrator::samples_are_independent(): what the network would only harm stays
                                   ///< (denoise::keep_clean_pixels)
    bool estimates_error = false;  ///< twice the work more; the film keeps halves and has no gains
    StopToken stop{};
  };
  /// Direct light is denoised by itself where the film keeps it and no gains change it (denoise::denoise_apart). Of 16
  /// samples and more, without gains, brightness is restored (denoise::restore_means), and what is clean stays.
  /// `features` may be null where they are not wanted. Light groups are denoised each by itself and then scaled, pixel
  /// by pixel, to add up to the whole; where none has light the first gets what there is. May throw Stopped.
  DenoisedFrame operator()(const scene::Film& film, const FeatureLayers* features, const Options& options) const;

 private:
  struct Layers;
  image::Image denoise(const Layers& layers, const denoise::Denoiser::Options& options) const;

  denoise::Denoiser denoiser_;
};

}  // namespace dapple::render
