// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "dapple/scenefile/scene_description.h"
#include "dapple/scenefile/scene_edit.h"

namespace dapple::scenefile {

/// What pbrt's attribute stack saves and restores.
struct GraphicsState {
  /// Kinds of directive that `Attribute "..."` sets default parameters for.
  enum Target { shape, light, material_target, medium, texture, target_count };

  TransformPair ctm;  ///< current transform: object to world
  bool start_is_active = true, end_is_active = true;
  bool reverse_orientation = false;
  MaterialIndex material = 0;
  int32_t area_light = -1;
  ColorSpace color_space = ColorSpace::srgb;
  std::string inside_medium, outside_medium;
  std::array<ParamSet::Defaults, target_count> defaults;
};

/// The semantics of pbrt-v4's directives: keeps the graphics state and fills a SceneDescription. A parser calls one
/// member for each directive, in file order, and finish() at the end. Every member throws InputError where the
/// directive is not legal.
///
/// Materials, media and objects may be named before they are defined (pbrt resolves names when the file has ended);
/// finish() reports names that never were, where they were used first.
class DescriptionBuilder {
 public:
  DescriptionBuilder(SceneDescription* description, Diagnostics* diagnostics);
  /// Goes on with a description that is whole: in the world, at its end, with the state that WorldBegin sets.
  void resume();

  bool in_world() const { return in_world_; }
  bool in_object() const { return active_object_ >= 0; }
  ColorSpace color_space() const { return state_.color_space; }

  // Options block.
  /// Film, Sampler, ...: `member` is SceneDescription's.
  void set_once(Entity SceneDescription::*member, std::string_view directive, Entity entity);
  void camera(Entity entity);
  void transform_times(double start, double end, const FileLoc& loc);
  void world_begin();

  // Transforms. A Transform that is singular or not finite is an InputError.
  void concat(const Transform& t, const FileLoc& loc);
  void set_transform(const Transform& t, const FileLoc& loc);
  void active_transform(bool start, bool end);
  void coordinate_system(const std::string& name);
  void coord_sys_transform(const std::string& name, const FileLoc& loc);

  // Graphics state.
  /// `is_transform`: TransformBegin and TransformEnd, which are the same by another name.
  void attribute_begin(const FileLoc& loc, bool is_transform = false);
  void attribute_end(const FileLoc& loc, bool is_transform = false);
  void attribute(GraphicsState::Target target, const ParamSet& params);
  void color_space(Entity entity, ColorSpace value);
  void reverse_orientation() { state_.reverse_orientation = !state_.reverse_orientation; }
  void medium_interface(const std::string& inside, const std::string& outside, const FileLoc& loc);
  void material(Entity entity);
  void named_material(const std::string& name, const FileLoc& loc);
  void area_light(Entity entity);

  // Definitions.
  void make_named_material(const std::string& name, Entity entity);
  void make_named_medium(const std::string& name, Entity entity);
  void define_texture(const std::string& name, bool is_spectrum, Entity entity);
  void object_begin(const std::string& name, const FileLoc& loc);
  void object_end(const FileLoc& loc);

  // Contents.
  void light(Entity entity);
  void shape(Entity entity);
  /// `own_name`: what the instance is called; empty: by its number.
  void object_instance(const std::string& name, const FileLoc& loc, const std::string& own_name = {});
  void object_instances(const std::string& name, const std::string& filename, const FileLoc& loc);

  // Changes (scene_edit.h).
  void edit(SceneEdit edit);
  /// Surfaces stay diced for the camera and the film as they are now.
  void dicing_camera(const FileLoc& loc);
  SceneEditor& editor() { return editor_; }

  /// A place to come back to: restore() takes back all that was added and edited since.
  struct Checkpoint;
  std::shared_ptr<const Checkpoint> checkpoint();
  void restore(const Checkpoint& checkpoint);
  /// Nobody will come back to any checkpoint.
  void forget_checkpoints() { edits_.clear(); }

  /// Import: between these the graphics state, its stack and the named coordinate systems are the imported file's own,
  /// beginning as copies; what it defines stays.
  struct Scope {
    GraphicsState state;
    std::map<std::string, TransformPair> coordinate_systems;
    size_t stack_floor = 0;
  };
  Scope begin_import();
  void end_import(Scope scope);

  /// End of the main file at `loc`, and of what is added to it later.
  void finish(const FileLoc& loc);

 private:
  enum class Bracket : uint8_t { attribute, transform, object };
  struct Pushed {
    GraphicsState state;
    FileLoc loc;
    Bracket bracket;
  };
  static std::string begin_name(Bracket bracket);
  static std::string end_name(Bracket bracket);

  void push(const FileLoc& loc, Bracket bracket);
  void pop(const FileLoc& loc, Bracket bracket);
  void check_stack_closed() const;
  void apply(const Transform& t, bool replace, const FileLoc& loc);
  MaterialIndex material_index(const std::string& name, const FileLoc& loc);
  int32_t object_index(const std::string& name, const FileLoc& loc);
  void check_affine(const FileLoc& loc) const;
  void check_levels() const;
  void mention_medium(const std::string& name, const FileLoc& loc);
  std::string take_type(Entity* entity, const char* directive, const std::string& name) const;

  SceneDescription& description_;
  Diagnostics& diagnostics_;
  GraphicsState state_;
  std::vector<Pushed> stack_;
  size_t stack_floor_ = 0;  // below it the stack belongs to the importing file
  std::map<std::string, TransformPair> coordinate_systems_;
  std::vector<bool> material_defined_, object_defined_;
  std::map<std::string, FileLoc> mentioned_media_;  // first use
  int32_t active_object_ = -1;
  bool in_world_ = false;
  SceneEditor editor_;
  std::vector<SceneEditor::Undo> edits_;  // since forget_checkpoints()
  bool has_checkpoint_ = false;
};

}  // namespace dapple::scenefile
