// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "dapple/scenefile/scene_description.h"

namespace dapple::scenefile {

/// What an edit is about; by these names in files.
enum class EditTarget : uint8_t {
  light,
  shape,
  object,
  material,
  texture,
  medium,
  group,
  camera,
  film,
  integrator,
  sampler
};
inline constexpr std::array<std::string_view, 11> edit_target_names = {
    "light", "shape", "object", "material", "texture", "medium", "group", "camera", "film", "integrator", "sampler"};

/// Of a camera, a film, an integrator and a sampler there is one, which needs no name.
constexpr bool has_name(EditTarget target) {
  return target < EditTarget::camera;
}

/// `Edit "light" "key" "float scale" 2` or `Remove "light" "key"` (docs/guide/scenes.md).
struct SceneEdit {
  EditTarget target = EditTarget::light;
  std::string name;  ///< empty where there is one only
  bool remove = false;
  bool declares = false;  ///< LightGroup: nothing needs to have the name yet
  ParamSet params;        ///< those to be set; without values: those to be taken out
  FileLoc loc;
};

/// Applies edits to a description. Items answer to their `"string name"`, materials, textures and media to the names
/// that they are defined by; those without one to `type:number`, counted from 1 within the type in the order of the
/// file. Objects, which are instances of definitions, are called `definition:number`, and all of one definition
/// `definition`; shapes of a definition `definition/type:number`. One name may be that of many items: all are edited.
/// A group of lights is called as lights call it.
class SceneEditor {
 public:
  explicit SceneEditor(SceneDescription* description) : d_(*description) {}

  /// Takes back what one edit did; to be called in the reverse order of the edits.
  using Undo = std::function<void()>;
  /// InputError, with nothing changed, for a name that nothing has, a transform that cannot be inverted, or a parameter
  /// of the wrong type among those that edits take beside the item's own. Whether the item's own parameters are right
  /// shows when it is built.
  Undo apply(SceneEdit edit);

  /// Names of what is there, in the order of the file; hidden items count, removed ones do not.
  std::vector<std::string> names(EditTarget target);
  /// Whether some of these are area lights.
  bool names_area_light(const std::string& light);
  /// The parameter that the first item of this name was given, or null.
  const Param* parameter(EditTarget target, const std::string& name, std::string_view param);
  /// A small file may set large parameters of many things many times: what it may set in all is bounded, from here on
  /// anew.
  void reset_bound() { work_ = 0; }
  /// After the description lost items other than by edits.
  void forget() { index_ = {}; }
  /// From here on shapes are added to this definition, and to no other.
  void begin_definition(size_t object) { index_.begun.push_back(object); }

 private:
  /// Item number `item` of its list; of a shape in a definition, of the list of `object`.
  struct Place {
    int32_t item = 0, object = -1;
    bool is_area_light = false;
  };
  struct Index {
    using Names = std::map<std::string, std::vector<Place>, std::less<>>;
    std::array<Names, edit_target_names.size()> names;
    std::array<std::vector<std::string>, edit_target_names.size()> order;
    std::map<std::string, int32_t, std::less<>> counts;
    std::vector<size_t> shapes_of_object;  ///< seen, by definition
    std::vector<size_t> begun;             ///< definitions that were named before, and may have grown
    size_t lights = 0, area_lights = 0, shapes = 0, materials = 0, textures = 0, media = 0, instances = 0;
  };
  struct Special;

  void update_index();
  void add_name(EditTarget target, const std::string& name, Place place);
  template <class E>
  void add_item(EditTarget target, const E& entity, const std::string& prefix, Place place);
  const std::vector<Place>& find(const SceneEdit& edit);
  const std::vector<Place>& find_group(const SceneEdit& edit);
  [[noreturn]] void refuse_name(const SceneEdit& edit);
  Entity* entity_at(EditTarget target, Place place);
  TransformPair* transform_at(EditTarget target, Place place);
  Presence presence_at(EditTarget target, Place place);
  void set_presence(EditTarget target, Place place, Presence presence, std::vector<Undo>* undo);
  void set_transform(EditTarget target, Place place, const Special& special, std::vector<Undo>* undo);
  void check(const SceneEdit& edit, const Special& special, const std::vector<Place>& places);
  void set_params(EditTarget target, Place place, const SceneEdit& edit, const Special& special,
                  std::vector<Undo>* undo);

  SceneDescription& d_;
  Index index_;
  std::vector<Place> group_place_;  ///< what find_group() found
  size_t work_ = 0;                 ///< things edited, large parameters counting more
};

}  // namespace dapple::scenefile
