// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dapple/build/scene_builder.h"
#include "dapple/render/gains.h"
#include "dapple/render/output.h"
#include "dapple/render/render_session.h"

namespace dapple::render {

/// A picture as asked for; the scene holds where this is silent, and its preset where both are.
struct PictureRequest {
  build::IntegratorRequest integrator;
  std::vector<std::string> aovs;
  bool light_groups = false;  ///< layers of them
  bool mixes = false;         ///< gains may change: their parts of the picture are kept where the integrator knows them
  std::string weights_folder;               ///< of the denoiser, denoise::find_weights()
  std::string weights;                      ///< a file in place of those
  float denoise_exposure = 0;               ///< FrameDenoiser::Options::exposure
  std::optional<CacheView> cache_view;      ///< in place of the picture, which is not denoised then
  double time_limit = 0, noise_target = 0;  ///< StopRules
  /// Scenes of the frames before and after this one, which tell AOV motion exactly and add motion_back; null: not
  /// known. They outlive the picture.
  const build::BuiltScene *previous = nullptr, *next = nullptr;
};

/// The request over the scene's, with what its layers need. UsageError for what contradicts itself or the scene.
build::IntegratorRequest settled_request(const build::BuiltScene& built, const PictureRequest& asked);

/// Film::Settings::direct: for its layer, or to be denoised by itself. UsageError for the layer where the integrator
/// does not know it.
bool keeps_direct(const integrate::Integrator& integrator, const std::vector<std::string>& aovs, bool denoises);

/// All between a built scene and a picture with its layers: integrator, rules, film, albedo and normals, denoising. It
/// is what `dapple render`, C++ and Python have in common. The scene outlives it.
class Picture {
 public:
  /// UsageError for requests that contradict each other or the integrator, IoError where denoising is asked for and its
  /// weights are missing; where a preset would have it, a warning. Makes the integrator, which may take as long as some
  /// samples; Stopped if `stop` ends that. `opacity`: of another picture by the same requests, whose scene has only got
  /// other lights or another camera; null: one is made. `known`: as of build::make_integrator().
  Picture(build::BuiltScene& built, const PictureRequest& request, StopToken stop = {},
          std::shared_ptr<const gi::OpacityCache> opacity = nullptr, build::Preparations* known = nullptr);
  ~Picture();

  const build::IntegratorRequest& request() const { return request_; }  ///< over the scene's
  const integrate::Integrator& integrator() const { return *integrator_; }
  const StopRules& rules() const { return rules_; }
  uint64_t seed() const { return seed_; }
  bool denoises() const { return denoiser_.has_value(); }
  /// Of the request, or all where the scene asks for them.
  const std::vector<std::string>& aovs() const { return aovs_; }
  /// With the scene's gains. Around a crop that is to be denoised, or whose errors are to be
  /// shown, it has a border, which layers() leaves out.
  scene::Film make_film() const;
  /// Has the session, which renders `film`, judge errors as they are after denoising, where the picture is denoised
  /// and rules() have a noise target or noisy blocks. Picture and film outlive the session's run.
  void judge(RenderSession& session, const scene::Film& film);
  int film_groups() const { return film_groups_; }
  /// How far back these gains in place of the scene's change a film of make_film(). Where that keeps no groups:
  /// `stored`, since light is not stored by them either.
  GainReach reach_of(const std::vector<RGB>& gains) const;
  /// Whether that is `sums` for whatever gains.
  bool weighs_gains() const;
  /// After the camera moved (build::outlasts_camera()), and between films.
  void begin_again() {
    features_.reset(), motion_.reset(), motion_back_.reset();
    integrator_->begin_again();
  }
  integrate::CacheState opacity_state() const;
  bool has_opacity_cache() const { return opacity_ != nullptr; }
  const std::shared_ptr<const gi::OpacityCache>& opacity_cache() const { return opacity_; }

  /// Traces what layers() want of the scene beside the film, which they do themselves if it was not done. May throw
  /// Stopped.
  void trace_features(StopToken stop = {});
  /// A film of make_film() as layers, denoised if that is asked for; `denoise` false leaves that out. The header says
  /// what was done, and the camera's matrices. May throw Stopped.
  /// Without `loops` no loop runs in parallel, as in a RenderSession::Pause: after trace_features().
  image::OutputImage layers(const scene::Film& film, bool denoise, StopToken stop = {}, bool loops = true);
  double feature_seconds() const { return feature_seconds_; }  ///< of trace_features()
  double denoise_seconds() const { return denoise_seconds_; }  ///< of the network, for the latest layers

 private:
  Box2i rendered_crop() const;
  bool judges_denoised() const;
  FrameDenoiser::Options denoising(bool estimates_error, int light_groups, StopToken stop) const;
  void trace_motion(const integrate::FeatureTracer::Settings& settings, StopToken stop);
  void add_header(OutputSettings* output) const;
  void add_cameras_of_motion(OutputSettings* output) const;
  std::string denoising_text(bool denoised) const;

  build::BuiltScene& built_;
  const PictureRequest asked_;
  std::vector<std::string> aovs_;
  build::IntegratorRequest request_;
  StopRules rules_;
  uint64_t seed_;
  int film_groups_ = 0;
  std::optional<FrameDenoiser> denoiser_;
  std::shared_ptr<const gi::OpacityCache> opacity_;
  std::unique_ptr<const integrate::Integrator> integrator_;
  std::optional<FeatureLayers> features_;
  std::optional<image::Image> motion_, motion_back_;
  bool lacks_weights_ = false;
  double feature_seconds_ = 0, denoise_seconds_ = 0;
};

/// What the header of any picture of the scene as it is says: program, scene, seed, the camera's matrices.
std::vector<std::pair<std::string, image::MetadataValue>> scene_header(const build::BuiltScene& built, uint64_t seed);

/// Adds to the header what a session came to.
void add_to_header(const SessionResult& result, image::OutputImage* picture);

}  // namespace dapple::render
