// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dapple/base/error.h"
#include "dapple/base/transform.h"
#include "dapple/scenefile/param_set.h"

namespace dapple::scenefile {

/// A transform at shutter open and at shutter close (equal where nothing moves).
struct TransformPair {
  Transform start, end;
  bool is_animated() const { return !(start == end); }
};

/// Whether an item takes part. What was removed keeps its place, so that places go on to mean the same.
enum class Presence : uint8_t { shown, hidden, removed };

/// One directive with a type and parameters: `Camera "perspective" ...`, `Film`, `Sampler`, ...
struct Entity {
  std::string type;
  ParamSet params;
  FileLoc loc;
  Presence presence = Presence::shown;  ///< of lights, area lights and shapes
  bool is_shown() const { return presence == Presence::shown; }
};

/// A material, named or not. `type` is pbrt's material type ("diffuse", ...).
struct MaterialEntity : Entity {
  std::string name;  ///< empty for Material, the name for MakeNamedMaterial
};

struct TextureEntity : Entity {
  std::string name;
  bool is_spectrum = false;  ///< "spectrum" texture; otherwise "float"
  TransformPair transform;   ///< texture to world
};

struct MediumEntity : Entity {
  std::string name;
  TransformPair transform;  ///< medium to world
};

struct LightEntity : Entity {
  TransformPair transform;  ///< light to world
  std::string medium;       ///< outside medium, empty for vacuum
};

/// Index of a MaterialEntity in SceneDescription::materials.
using MaterialIndex = int32_t;

struct ShapeEntity : Entity {
  TransformPair transform;  ///< object to world; inside an object definition: object to the definition's space
  bool reverse_orientation = false;
  MaterialIndex material = 0;
  /// Index into SceneDescription::area_lights, -1 for none.
  int32_t area_light = -1;
  std::string inside_medium, outside_medium;
};

/// An affine TransformPair in the space of 12 floats, and of 12 more only where it moves: there may be millions of
/// instances. Where a translation is 256 or more, as many doubles are kept as well.
class CompactTransform {
 public:
  explicit CompactTransform(const TransformPair& affine);
  TransformPair expand() const;
  /// As the file says it, where it is far; else as expand().
  TransformPair exact() const;
  /// Of the bits: transforms of one key are most likely the same.
  uint64_t key() const;
  friend bool operator==(const CompactTransform& a, const CompactTransform& b);

 private:
  using Rows = std::array<float, 12>;  ///< the upper three rows
  using ExactRows = std::array<double, 12>;
  Rows start_;
  std::unique_ptr<const Rows> end_;
  std::unique_ptr<const ExactRows[]> far_;  ///< at the start, and at the end if there is end_; null if near
};

/// ObjectInstance: `object` indexes SceneDescription::objects; the transform is applied after those of the definition
/// (shapes in a definition carry the CTM at their place, as in pbrt-v4).
struct InstanceEntity {
  CompactTransform transform;
  FileLoc loc;
  int32_t object = 0;
  Presence presence = Presence::shown;
  bool is_shown() const { return presence == Presence::shown; }
};

/// LightGroup: what is said of a group of lights (`"string group"` of lights), once each.
struct LightGroupEntity : Entity {
  std::string name;
};

/// ObjectInstances: an object at all places of a file (placement_file.h), which stays where it is until it is built.
struct PlacementsEntity {
  Transform transform;  ///< to the world, or inside a definition to its space; it does not move
  FileLoc loc;
  int32_t object = 0;
  std::string filename;  ///< as the scene has it
};

/// ObjectBegin ... ObjectEnd. `loc` is that of ObjectBegin. The text of definitions does not nest; unlike pbrt-v4's
/// they may hold other objects, most_object_levels of them one inside of the other at most, and never themselves.
struct ObjectEntity {
  std::string name;
  FileLoc loc;
  std::vector<ShapeEntity> shapes;
  std::vector<InstanceEntity> instances{};
  std::vector<PlacementsEntity> placements{};
  bool holds_objects() const { return !instances.empty() || !placements.empty(); }
};

/// Of placements on the way from the scene to a shape: forest, tree, branch, leaf.
inline constexpr int most_object_levels = 4;

/// DicingCamera: the camera and the film for which surfaces are diced, wherever the camera goes from there on.
struct DicingCameraEntity {
  Entity camera, film;
  TransformPair world_to_camera;
};

/// What a scene file says, with nothing interpreted beyond the directives: neutral between file formats. Every item
/// keeps its FileLoc, whose file names live in `files`. Move-only, because ParamSets and FileLocs point into it.
struct SceneDescription {
  SceneDescription() = default;
  SceneDescription(SceneDescription&&) = default;
  SceneDescription& operator=(SceneDescription&&) = default;

  std::deque<std::string> files;  ///< paths as opened, the main file first; stable addresses
  std::string base_directory;     ///< relative file names in parameters are relative to this (the main file's folder)

  uint64_t fingerprint = 0;  ///< of the text of all files, as read

  // Each exactly once; an empty type means that the file is silent: pbrt-v4's default holds (camera "perspective" at
  // the origin, film "rgb", ...). color_space is the one of the film; parameters carry their own (Param::color_space).
  Entity camera, film, sampler, pixel_filter, integrator, accelerator, color_space;
  TransformPair world_to_camera;
  double shutter_start_transform_time = 0, shutter_end_transform_time = 1;  ///< TransformTimes
  std::string camera_medium;
  std::optional<DicingCameraEntity> dicing_camera;  ///< none: that is the camera
  ParamSet options;  ///< Option directives: names in lower case without '_' and '-'; of equal names the last

  /// [0] is the default: "diffuse" without parameters (pbrt: reflectance .5). A material may be used before its
  /// definition, so the order is that of first mention.
  std::vector<MaterialEntity> materials;
  std::map<std::string, MaterialIndex> named_materials;
  std::vector<TextureEntity> textures;  ///< in order of definition; a texture may only use earlier ones
  std::map<std::string, int32_t> float_textures, spectrum_textures;  ///< name to index in textures
  std::vector<MediumEntity> media;
  std::map<std::string, int32_t> named_media;
  std::vector<Entity> area_lights;  ///< one for each AreaLightSource, shared by the shapes after it
  std::vector<LightEntity> lights;
  std::vector<LightGroupEntity> light_groups;  ///< those of which something was said
  std::vector<ShapeEntity> shapes;
  std::vector<ObjectEntity> objects;
  std::map<std::string, int32_t> named_objects;
  std::vector<InstanceEntity> instances;
  std::vector<PlacementsEntity> placements;
  std::map<uint32_t, std::string> instance_names;  ///< of those that have one, by their place in instances

  /// Whether a shape shines.
  bool emits(const ShapeEntity& shape) const {
    return shape.area_light >= 0 && area_lights[size_t(shape.area_light)].is_shown();
  }

  /// Keeps files that were written for this description alone (pictures from inside of models) until what was built of
  /// it has gone too.
  std::shared_ptr<const void> temporary_files;

  /// Absolute or base_directory-relative path of a file named in a parameter.
  std::string resolve(const std::string& filename) const;
};

class DescriptionBuilder;

/// Reads files of other formats where Import names them.
class Importer {
 public:
  virtual ~Importer() = default;
  virtual bool reads(const std::string& path) const = 0;
  /// Adds what `path`, named at `loc`, holds to a description that is being built. Throws InputError.
  virtual void import(const std::string& path, const FileLoc& loc, SceneDescription* description,
                      DescriptionBuilder* builder, Diagnostics* diagnostics) = 0;
};

/// Reads a scene, its Includes and Imports. Throws InputError; survivable findings go to `diagnostics`.
SceneDescription read_pbrt(const std::string& path, Diagnostics& diagnostics, Importer* importer = nullptr);
/// The same from memory, for tests and fuzzing; `name` stands in locations, includes are relative to `base_directory`.
SceneDescription parse_pbrt(std::string text, const std::string& name, const std::string& base_directory,
                            Diagnostics& diagnostics, Importer* importer = nullptr);

}  // namespace dapple::scenefile
