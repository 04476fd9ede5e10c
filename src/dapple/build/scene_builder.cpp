// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/scene_builder.h"

#include <algorithm>
#include <utility>

#include "dapple/base/timer.h"
#include "dapple/build/editable_scene.h"
#include "dapple/media/closed_form_medium.h"

namespace dapple::build {

using scenefile::SceneDescription;

BuiltScene::~BuiltScene() {
  scene.reset();
}

BuiltScene& BuiltScene::operator=(BuiltScene&& other) noexcept {
  scene.reset();  // before what its textures read
  scene = std::move(other.scene);
  origin = other.origin;
  film = std::move(other.film);
  request = std::move(other.request);
  dicing_camera = other.dicing_camera;
  times = other.times;
  named_files = std::move(other.named_files);
  temporary_files = std::move(other.temporary_files);
  texture_system = std::move(other.texture_system);
  return *this;
}

BuiltScene build_scene(const SceneDescription& description, const BuildOptions& options, Diagnostics& diagnostics) {
  return std::move(EditableScene(description, options, diagnostics).built());
}

namespace {

// What only absorbs has no shafts, whose tables are made for a camera.
bool may_have_shafts(const scene::Scene& scene) {
  return std::any_of(scene.media.begin(), scene.media.end(), [](const auto& medium) {
    const auto* closed = dynamic_cast<const media::ClosedFormMedium*>(medium.get());
    return !closed || !closed->sigma_s().is_black();
  });
}

}  // namespace

bool outlasts_camera(const BuiltScene& built, const IntegratorRequest& r) {
  const auto moves = [](const scene::Camera& c) { return c.settings().camera_to_world.is_animated(); };
  return !may_have_shafts(*built.scene) && r.masks.sun_shadows.value_or("rays") == "rays" &&
         !(r.masks.far_ground.value_or(0) > 0) && r.type != "canopy" && r.type != "images" &&
         !moves(built.dicing_camera) && !moves(built.scene->camera);
}

std::unique_ptr<const integrate::Integrator> make_integrator(BuiltScene& built, const IntegratorRequest& request,
                                                             int pixel_samples, uint64_t seed, StopToken stop,
                                                             Preparations* known) {
  if (!outlasts_camera(built, request)) return make_integrator(*built.scene, request, pixel_samples, seed, stop);
  const scene::Camera camera = std::exchange(built.scene->camera, built.dicing_camera);
  try {
    auto integrator = make_integrator(*built.scene, request, pixel_samples, seed, stop, known);
    built.scene->camera = camera;
    return integrator;
  } catch (...) {
    built.scene->camera = camera;
    throw;
  }
}

BuiltScene load_scene(const std::string& path, const BuildOptions& options, Diagnostics& diagnostics) {
  const Timer timer;
  modelfile::ModelOptions model = options.model;
  if (!model.resolution) model.resolution = options.film.resolution;
  const SceneDescription description = modelfile::read_scene(path, model, diagnostics);
  const double parse_seconds = timer.seconds();
  BuiltScene built = build_scene(description, options, diagnostics);
  built.times.parse_seconds = parse_seconds;
  built.times.total_seconds += parse_seconds;
  return built;
}

}  // namespace dapple::build
