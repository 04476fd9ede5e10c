// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "dapple/build/area_light_shapes.h"
#include "dapple/build/glow_factory.h"
#include "dapple/build/scene_builder.h"
#include "dapple/build/texture_factory.h"

namespace dapple::build {

/// What edits of a description touched; of what is built from the rest as much is kept as is known not to depend on it.
struct Changes {
  bool camera = false;       ///< where it is and what it is
  bool settings = false;     ///< film, sampler, integrator
  bool lights = false;       ///< those that are no area lights
  bool area_lights = false;  ///< what they emit
  bool materials = false;    ///< parameters of materials
  bool gains = false;        ///< of light groups
  bool geometry = false;     ///< shapes, instances: textures stay
  bool all = false;          ///< anything else
  bool emitters = false;     ///< which surfaces emit; EditableScene::update() finds it out

  bool any() const { return camera || settings || lights || area_lights || materials || gains || geometry || all; }
  Changes& operator|=(const Changes& o) {
    camera |= o.camera, settings |= o.settings, lights |= o.lights, area_lights |= o.area_lights,
        materials |= o.materials, gains |= o.gains, geometry |= o.geometry, all |= o.all, emitters |= o.emitters;
    return *this;
  }
};

/// A scene that follows its description. What it is after any updates equals, bit for bit, what a new one of the same
/// description is.
class EditableScene {
 public:
  /// Description and diagnostics outlive the object. Throws as build_scene().
  EditableScene(const scenefile::SceneDescription& description, const BuildOptions& options, Diagnostics& diagnostics);
  ~EditableScene();

  BuiltScene& built() { return built_; }
  /// BuiltScene::named_files of the description as it is.
  std::vector<std::string> built_files() const;
  const BuildOptions& options() const { return options_; }
  /// Of the scene's groups, by the description as it is. InputError for what is no gain.
  std::vector<RGB> described_gains() const;
  /// BuiltScene::request by the description as it is. InputError.
  IntegratorRequest described_request() const;

  /// Makes again what changed. InputError: built() is what it was. Nobody may use the scene meanwhile. Returns what was
  /// made again: some edits of materials take the geometry with them.
  Changes update(Changes changes);
  /// The same for other film settings.
  Changes update(Changes changes, const FilmOverrides& film);

 private:
  struct Parts;
  void build_all();
  bool build_geometry();
  void build_scene_parts(BuiltScene& built);
  void read_view(Parts* parts) const;
  bool make_materials_again(Parts* parts) const;
  void make_lights(Parts* parts, const AreaLightShapes* areas) const;
  void set_lights(scene::Scene* scene, const AreaLightShapes& shapes, Parts* parts);
  void warn_of_emptiness() const;

  const scenefile::SceneDescription& description_;
  BuildOptions options_;
  Diagnostics& diagnostics_;
  std::unique_ptr<BuildContext> context_;
  std::unique_ptr<TextureLibrary> textures_;
  AreaLightShapes area_light_shapes_;
  size_t area_lights_ = 0;          ///< that stand first among the scene's lights
  scene::LightGroups area_groups_;  ///< of these
  std::vector<GlowPlace> glow_;
  bool glowing_materials_ = false;  ///< some of the area lights are of materials
  BuiltScene built_;
};

}  // namespace dapple::build
