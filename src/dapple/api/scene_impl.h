// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <dapple/dapple.h>

#include <atomic>
#include <new>
#include <utility>

#include "dapple/base/error.h"
#include "dapple/image/image_writer.h"
#include "dapple/render/picture.h"
#include "dapple/render/working_scene.h"

namespace dapple {

class Scene::Impl {
 public:
  explicit Impl(std::unique_ptr<render::WorkingScene> scene) : owned(std::move(scene)), working(owned.get()) {}
  /// Within a live session, which owns it.
  explicit Impl(render::WorkingScene* scene) : working(scene) {}
  std::unique_ptr<render::WorkingScene> owned;
  render::WorkingScene* working;

  /// Marks a scene as being built or rendered; UsageError if it is, by whatever thread, or if a live session owns it.
  class Busy {
   public:
    explicit Busy(Impl& scene) : scene_(scene) {
      if (!scene.owned) throw UsageError("a live session builds and renders its scene itself");
      if (scene.is_busy.exchange(true)) throw UsageError("the scene is being rendered");
    }
    ~Busy() { scene_.is_busy = false; }
    Busy(const Busy&) = delete;
    Busy& operator=(const Busy&) = delete;

   private:
    Impl& scene_;
  };

  std::atomic<bool> is_busy{false};
};

namespace api {

/// The error that `error` is outside, with its place.
SceneError outside(const Error& error);

/// Runs work whose errors are to be SceneErrors.
template <class Work>
auto guarded(const Work& work) {
  try {
    return work();
  } catch (const Error& error) {
    throw outside(error);
  }
}

/// ` "type name" [ values ]` of each; UsageError for what the language cannot say, as numbers that are not finite.
std::string text_of(const Params& params);
std::string text_of(const Placement& placement);  ///< Transform [ ... ]

render::PictureRequest request_of(const RenderOptions& options);
build::FilmOverrides film_of(const RenderOptions& options);
Picture frame_of(image::OutputImage picture);
Statistics statistics_of(const render::SessionResult& result);

}  // namespace api
}  // namespace dapple
