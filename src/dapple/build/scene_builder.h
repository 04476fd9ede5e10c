// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dapple/build/build_context.h"
#include "dapple/build/camera_factory.h"
#include "dapple/build/integrator_factory.h"
#include "dapple/build/light_group_factory.h"
#include "dapple/image/texture_system.h"
#include "dapple/modelfile/scene_reader.h"
#include "dapple/scene/scene.h"
#include "dapple/vegetation/aggregate_pruning.h"

namespace dapple::build {

/// Where the time and memory of loading went. Seconds and bytes.
struct BuildTimes {
  double parse_seconds = 0;         ///< of the scene file
  double shape_seconds = 0;         ///< mesh files, subdivision, handing over to Embree
  double acceleration_seconds = 0;  ///< Embree's build
  double total_seconds = 0;
  size_t shape_bytes = 0;
  vegetation::PruningCounts pruned;  ///< by the level of detail
};

struct BuildOptions {
  FilmOverrides film;
  bool keep_going = false;
  std::vector<GainOverride> gains;
  modelfile::ModelOptions model;  ///< where load_scene() reads a model
  /// Repeats the scene without end along x and y (trace::TracedScene::set_period). What sticks out of the cell comes in
  /// on its other side.
  std::optional<Imath::Box2d> period;
  /// level_of_detail(), in place of the scene's. Scenes that are repeated keep all details.
  std::optional<float> lod;
};

/// A scene ready to render, with what its file asks for.
struct BuiltScene {
  std::unique_ptr<scene::Scene> scene;
  V3d origin{0, 0, 0};  ///< what was taken off positions: those of the scene plus this are those of the file
  FilmRequest film;
  IntegratorRequest request;
  scene::Camera dicing_camera;  ///< for which surfaces are diced: the scene's, unless the file has a DicingCamera
  BuildTimes times;
  std::vector<std::string> named_files;         ///< scenefile::named_files()
  std::shared_ptr<const void> temporary_files;  ///< SceneDescription::temporary_files
  /// Owns what image textures read; outlives the scene.
  std::unique_ptr<image::TextureSystem> texture_system;

  ~BuiltScene();
  BuiltScene() = default;
  BuiltScene(BuiltScene&&) = default;
  BuiltScene& operator=(BuiltScene&& other) noexcept;
};

/// SceneDescription to frozen Scene. Throws InputError for what cannot be rendered; what can be approximated goes to
/// `diagnostics`.
BuiltScene build_scene(const scenefile::SceneDescription& description, const BuildOptions& options,
                       Diagnostics& diagnostics);
/// Makes the integrator asked for (integrator_factory.h). Where the scene has a DicingCamera, what is learned before
/// rendering is learned from there, so that the camera may go elsewhere and find it still true; but not in scenes with
/// media that scatter, masks or far ground, whose tables are made for the camera itself, and where `known` is left as
/// it is.
std::unique_ptr<const integrate::Integrator> make_integrator(BuiltScene& built, const IntegratorRequest& request,
                                                             int pixel_samples, uint64_t seed, StopToken stop = {},
                                                             Preparations* known = nullptr);
/// Whether that holds: the integrator stays what it would be made anew after the camera moved.
bool outlasts_camera(const BuiltScene& built, const IntegratorRequest& request);

/// Reads a scene or a model by its extension (modelfile/scene_reader.h) and builds it.
BuiltScene load_scene(const std::string& path, const BuildOptions& options, Diagnostics& diagnostics);

}  // namespace dapple::build
