// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dapple/build/scene_builder.h"
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
  double time_limit = 0, noise_target = 0;  ///< StopRules
};

/// Film::Settings::direct: for its layer, or to be denoised by itself. UsageError for the layer where the integrator
/// does not know it.
bool keeps_direct(const integrate::Integrator& integrator, const std::vector<std::string>& aovs, bool denoises);

/// All between a built scene and a picture with its layers: integrator, rules, film, albedo and normals, denoising. The
/// scene outlives it; it is what `dapple render` does of the same options.
class Picture {
 public:
  /// UsageError for requests that contradict each other or the integrator, IoError where denoising is asked for and its
  /// weights are missing. Makes the integrator, which may take as long as some samples; Stopped if `stop` ends that.
  /// `opacity`: of another picture by the same requests, whose scene has only got other lights or another camera; null:
  /// one is made.
  Picture(build::BuiltScene& built, const PictureRequest& request, StopToken stop = {},
          std::shared_ptr<const gi::OpacityCache> opacity = nullptr);
  ~Picture();

  const build::IntegratorRequest& request() const { return request_; }  ///< over the scene's
  const integrate::Integrator& integrator() const { return *integrator_; }
  const StopRules& rules() const { return rules_; }
  uint64_t seed() const { return seed_; }
  bool denoises() const { return denoiser_.has_value(); }
  /// With the scene's gains.
  scene::Film make_film() const;
  int film_groups() const { return film_groups_; }
  /// Whether a film of make_film() can show these gains.
  bool keeps_for(const std::vector<RGB>& gains) const;
  /// After the camera moved (build::outlasts_camera()), and between films.
  void begin_again() {
    features_.reset(), motion_.reset();
    integrator_->begin_again();
  }
  integrate::CacheState opacity_state() const;
  bool has_opacity_cache() const { return opacity_ != nullptr; }
  const std::shared_ptr<const gi::OpacityCache>& opacity_cache() const { return opacity_; }

  /// A film of make_film() as layers, denoised if that is asked for; `denoise` false leaves that out. May throw
  /// Stopped.
  /// Without `loops` no loop runs in parallel, as in a RenderSession::Pause, where the picture has been asked for
  /// layers of a film before.
  image::OutputImage layers(const scene::Film& film, bool denoise, StopToken stop = {}, bool loops = true);

 private:
  build::BuiltScene& built_;
  const PictureRequest asked_;
  build::IntegratorRequest request_;
  StopRules rules_;
  uint64_t seed_;
  int film_groups_ = 0;
  std::optional<FrameDenoiser> denoiser_;
  std::shared_ptr<const gi::OpacityCache> opacity_;
  std::unique_ptr<const integrate::Integrator> integrator_;
  std::optional<FeatureLayers> features_;
  std::optional<image::Image> motion_;
};

}  // namespace dapple::render
