// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/description_builder.h"

#include <utility>

#include "dapple/scenefile/text.h"

namespace dapple::scenefile {

namespace {

// A scene is a few dozen deep; a file that is not one must not fill the memory with copies of the state.
constexpr size_t max_nesting = 10000;

template <class Derived>
Derived derived_from(Entity entity) {
  Derived d;
  static_cast<Entity&>(d) = std::move(entity);
  return d;
}

}  // namespace

DescriptionBuilder::DescriptionBuilder(SceneDescription* description, Diagnostics* diagnostics)
    : description_(*description), diagnostics_(*diagnostics), editor_(description) {
  MaterialEntity fallback;
  fallback.type = "diffuse";
  description_.materials.push_back(std::move(fallback));
  material_defined_.push_back(true);
}

void DescriptionBuilder::resume() {
  description_.materials.pop_back();  // the fallback that this builder began with, of which there is one already
  material_defined_.assign(description_.materials.size(), true);
  object_defined_.assign(description_.objects.size(), true);
  world_begin();
}

void DescriptionBuilder::set_once(Entity SceneDescription::*member, std::string_view directive, Entity entity) {
  Entity& slot = description_.*member;
  if (slot.loc.line != 0)
    diagnostics_.warn(entity.loc,
                      std::string(directive) + " is given again; this one replaces the one at " + slot.loc.to_string());
  slot = std::move(entity);
}

void DescriptionBuilder::camera(Entity entity) {
  set_once(&SceneDescription::camera, "Camera", std::move(entity));
  description_.world_to_camera = state_.ctm;
  description_.camera_medium = state_.outside_medium;
  coordinate_systems_["camera"] = {state_.ctm.start.inverse(), state_.ctm.end.inverse()};
}

void DescriptionBuilder::transform_times(double start, double end, const FileLoc& loc) {
  if (!(start <= end)) throw InputError(loc, "TransformTimes: the start time lies after the end time");
  description_.shutter_start_transform_time = start;
  description_.shutter_end_transform_time = end;
}

void DescriptionBuilder::world_begin() {
  in_world_ = true;
  state_.ctm = {};
  state_.start_is_active = state_.end_is_active = true;
  coordinate_systems_["world"] = state_.ctm;
}

void DescriptionBuilder::apply(const Transform& t, bool replace, const FileLoc& loc) {
  if (!t.is_finite()) throw InputError(loc, "the transform is not finite");
  if (!t.is_invertible()) throw InputError(loc, "the transform is singular: it has no inverse");
  for (const auto& [active, ctm] :
       {std::pair(state_.start_is_active, &state_.ctm.start), {state_.end_is_active, &state_.ctm.end}}) {
    if (!active) continue;
    *ctm = replace ? t : *ctm * t;
    if (!ctm->is_finite() || !ctm->inverse().is_finite())
      throw InputError(loc, "the transform and those before it combine to one that is singular or not finite");
  }
}

void DescriptionBuilder::concat(const Transform& t, const FileLoc& loc) {
  apply(t, false, loc);
}
void DescriptionBuilder::set_transform(const Transform& t, const FileLoc& loc) {
  apply(t, true, loc);
}

void DescriptionBuilder::active_transform(bool start, bool end) {
  state_.start_is_active = start;
  state_.end_is_active = end;
}

void DescriptionBuilder::coordinate_system(const std::string& name) {
  coordinate_systems_[name] = state_.ctm;
}

void DescriptionBuilder::coord_sys_transform(const std::string& name, const FileLoc& loc) {
  const auto it = coordinate_systems_.find(name);
  if (it == coordinate_systems_.end()) {
    diagnostics_.warn(loc,
                      "CoordSysTransform: no coordinate system " + in_quotes(name) + "; the transform stays as it is");
    return;
  }
  state_.ctm = it->second;
}

std::string DescriptionBuilder::begin_name(Bracket bracket) {
  return bracket == Bracket::object      ? "ObjectBegin"
         : bracket == Bracket::transform ? "TransformBegin"
                                         : "AttributeBegin";
}
std::string DescriptionBuilder::end_name(Bracket bracket) {
  return bracket == Bracket::object ? "ObjectEnd" : bracket == Bracket::transform ? "TransformEnd" : "AttributeEnd";
}

void DescriptionBuilder::push(const FileLoc& loc, Bracket bracket) {
  if (stack_.size() >= max_nesting)
    throw InputError(loc, begin_name(bracket) + " is nested more than " + std::to_string(max_nesting) + " deep");
  stack_.push_back({state_, loc, bracket});
}

void DescriptionBuilder::pop(const FileLoc& loc, Bracket bracket) {
  if (stack_.size() <= stack_floor_) throw InputError(loc, end_name(bracket) + " without " + begin_name(bracket));
  Pushed& top = stack_.back();
  if ((top.bracket == Bracket::object) != (bracket == Bracket::object))
    throw InputError(loc, end_name(bracket) + " inside of the " + begin_name(top.bracket) + " at " +
                              top.loc.to_string() + "; expected " + end_name(top.bracket));
  state_ = std::move(top.state);
  stack_.pop_back();
}

void DescriptionBuilder::check_stack_closed() const {
  if (stack_.size() <= stack_floor_) return;
  const Pushed& open = stack_.back();
  throw InputError(open.loc, begin_name(open.bracket) + " has no " + end_name(open.bracket));
}

void DescriptionBuilder::attribute_begin(const FileLoc& loc, bool is_transform) {
  push(loc, is_transform ? Bracket::transform : Bracket::attribute);
}
void DescriptionBuilder::attribute_end(const FileLoc& loc, bool is_transform) {
  pop(loc, is_transform ? Bracket::transform : Bracket::attribute);
}

void DescriptionBuilder::attribute(GraphicsState::Target target, const ParamSet& params) {
  ParamSet::Defaults& defaults = state_.defaults[target];
  ParamSet merged = defaults ? *defaults : ParamSet();
  for (const Param& p : params.all()) merged.add(p);
  defaults = std::make_shared<const ParamSet>(std::move(merged));
}

void DescriptionBuilder::color_space(Entity entity, ColorSpace value) {
  state_.color_space = value;
  if (!in_world_) description_.color_space = std::move(entity);
}

void DescriptionBuilder::mention_medium(const std::string& name, const FileLoc& loc) {
  if (!name.empty()) mentioned_media_.emplace(name, loc);
}

void DescriptionBuilder::medium_interface(const std::string& inside, const std::string& outside, const FileLoc& loc) {
  mention_medium(inside, loc);
  mention_medium(outside, loc);
  state_.inside_medium = inside;
  state_.outside_medium = outside;
}

void DescriptionBuilder::material(Entity entity) {
  entity.params.set_defaults(state_.defaults[GraphicsState::material_target]);
  state_.material = MaterialIndex(description_.materials.size());
  description_.materials.push_back(derived_from<MaterialEntity>(std::move(entity)));
  material_defined_.push_back(true);
}

MaterialIndex DescriptionBuilder::material_index(const std::string& name, const FileLoc& loc) {
  const auto [it, is_new] = description_.named_materials.emplace(name, MaterialIndex(description_.materials.size()));
  if (is_new) {
    MaterialEntity mentioned;
    mentioned.name = name;
    mentioned.loc = loc;
    description_.materials.push_back(std::move(mentioned));
    material_defined_.push_back(false);
  }
  return it->second;
}

void DescriptionBuilder::named_material(const std::string& name, const FileLoc& loc) {
  state_.material = material_index(name, loc);
}

std::string DescriptionBuilder::take_type(Entity* entity, const char* directive, const std::string& name) const {
  const Param* type = entity->params.find("type", ParamType::string);
  if (!type || type->strings.size() != 1)
    throw InputError(entity->loc,
                     std::string(directive) + " " + in_quotes(name) + ": expected a parameter \"string type\"");
  return type->strings[0];
}

void DescriptionBuilder::make_named_material(const std::string& name, Entity entity) {
  entity.params.set_defaults(state_.defaults[GraphicsState::material_target]);
  entity.type = take_type(&entity, "MakeNamedMaterial", name);
  const MaterialIndex i = material_index(name, entity.loc);
  MaterialEntity& slot = description_.materials[size_t(i)];
  if (material_defined_[size_t(i)])
    throw InputError(entity.loc, "material " + in_quotes(name) + " is defined already, at " + slot.loc.to_string());
  static_cast<Entity&>(slot) = std::move(entity);
  material_defined_[size_t(i)] = true;
}

void DescriptionBuilder::make_named_medium(const std::string& name, Entity entity) {
  entity.params.set_defaults(state_.defaults[GraphicsState::medium]);
  entity.type = take_type(&entity, "MakeNamedMedium", name);
  const auto [it, is_new] = description_.named_media.emplace(name, int32_t(description_.media.size()));
  if (!is_new)
    throw InputError(entity.loc, "medium " + in_quotes(name) + " is defined already, at " +
                                     description_.media[size_t(it->second)].loc.to_string());
  MediumEntity medium = derived_from<MediumEntity>(std::move(entity));
  medium.name = name;
  medium.transform = state_.ctm;
  description_.media.push_back(std::move(medium));
}

void DescriptionBuilder::define_texture(const std::string& name, bool is_spectrum, Entity entity) {
  entity.params.set_defaults(state_.defaults[GraphicsState::texture]);
  auto& names = is_spectrum ? description_.spectrum_textures : description_.float_textures;
  const auto [it, is_new] = names.emplace(name, int32_t(description_.textures.size()));
  if (!is_new)
    throw InputError(entity.loc, std::string(is_spectrum ? "spectrum" : "float") + " texture " + in_quotes(name) +
                                     " is defined already, at " +
                                     description_.textures[size_t(it->second)].loc.to_string());
  TextureEntity texture = derived_from<TextureEntity>(std::move(entity));
  texture.name = name;
  texture.is_spectrum = is_spectrum;
  texture.transform = state_.ctm;
  description_.textures.push_back(std::move(texture));
}

void DescriptionBuilder::area_light(Entity entity) {
  if (entity.type.empty()) {
    state_.area_light = -1;
    return;
  }
  entity.params.set_defaults(state_.defaults[GraphicsState::light]);
  entity.params.item_name();
  state_.area_light = int32_t(description_.area_lights.size());
  description_.area_lights.push_back(std::move(entity));
}

void DescriptionBuilder::light(Entity entity) {
  entity.params.set_defaults(state_.defaults[GraphicsState::light]);
  entity.params.item_name();
  LightEntity light = derived_from<LightEntity>(std::move(entity));
  light.transform = state_.ctm;
  light.medium = state_.outside_medium;
  description_.lights.push_back(std::move(light));
}

void DescriptionBuilder::shape(Entity entity) {
  entity.params.set_defaults(state_.defaults[GraphicsState::shape]);
  entity.params.item_name();
  ShapeEntity shape = derived_from<ShapeEntity>(std::move(entity));
  shape.transform = state_.ctm;
  shape.reverse_orientation = state_.reverse_orientation;
  shape.material = state_.material;
  shape.area_light = state_.area_light;
  shape.inside_medium = state_.inside_medium;
  shape.outside_medium = state_.outside_medium;
  auto& shapes = active_object_ < 0 ? description_.shapes : description_.objects[size_t(active_object_)].shapes;
  shapes.push_back(std::move(shape));
}

int32_t DescriptionBuilder::object_index(const std::string& name, const FileLoc& loc) {
  const auto [it, is_new] = description_.named_objects.emplace(name, int32_t(description_.objects.size()));
  if (is_new) {
    description_.objects.push_back({name, loc, {}, {}, {}});
    object_defined_.push_back(false);
  }
  return it->second;
}

void DescriptionBuilder::object_begin(const std::string& name, const FileLoc& loc) {
  if (active_object_ >= 0)
    throw InputError(loc, "ObjectBegin inside of the definition of " +
                              in_quotes(description_.objects[size_t(active_object_)].name) +
                              "; definitions do not nest");
  const int32_t i = object_index(name, loc);
  ObjectEntity& object = description_.objects[size_t(i)];
  if (object_defined_[size_t(i)])
    throw InputError(loc, "object " + in_quotes(name) + " is defined already, at " + object.loc.to_string());
  push(loc, Bracket::object);
  object.loc = loc;
  object_defined_[size_t(i)] = true;
  active_object_ = i;
  editor_.begin_definition(size_t(i));
}

void DescriptionBuilder::object_end(const FileLoc& loc) {
  pop(loc, Bracket::object);
  active_object_ = -1;
}

void DescriptionBuilder::object_instance(const std::string& name, const FileLoc& loc, const std::string& own_name) {
  check_affine(loc);
  if (active_object_ >= 0) {
    if (!own_name.empty())
      diagnostics_.warn(loc, "an instance inside of a definition has no name that edits know",
                        "name inside definition");
    const int32_t object = object_index(name, loc);
    description_.objects[size_t(active_object_)].instances.push_back({CompactTransform(state_.ctm), loc, object});
    return;
  }
  if (!own_name.empty()) description_.instance_names.emplace(uint32_t(description_.instances.size()), own_name);
  description_.instances.push_back({CompactTransform(state_.ctm), loc, object_index(name, loc)});
}

void DescriptionBuilder::object_instances(const std::string& name, const std::string& filename, const FileLoc& loc) {
  check_affine(loc);
  if (state_.ctm.is_animated())
    throw InputError(loc, "ObjectInstances: the transform moves; expected one that stands still");
  PlacementsEntity entity{state_.ctm.start, loc, object_index(name, loc), filename};
  auto& all = active_object_ < 0 ? description_.placements : description_.objects[size_t(active_object_)].placements;
  all.push_back(std::move(entity));
}

void DescriptionBuilder::check_affine(const FileLoc& loc) const {
  for (const Transform* t : {&state_.ctm.start, &state_.ctm.end}) {
    const M44d& m = t->matrix();
    if (m[3][0] != 0 || m[3][1] != 0 || m[3][2] != 0 || m[3][3] != 1)
      throw InputError(loc, "the transform of an instance must be affine: its last row must be 0 0 0 1");
  }
}

void DescriptionBuilder::edit(SceneEdit edit) {
  if (edit.target == EditTarget::material)
    if (const auto it = description_.named_materials.find(edit.name);
        it != description_.named_materials.end() && !material_defined_[size_t(it->second)])
      throw InputError(edit.loc, "material " + in_quotes(edit.name) + " is edited before it is defined");
  SceneEditor::Undo undo = editor_.apply(std::move(edit));
  if (has_checkpoint_) edits_.push_back(std::move(undo));
}

void DescriptionBuilder::dicing_camera(const FileLoc& loc) {
  if (description_.camera.type.empty())
    throw InputError(loc, "DicingCamera: there is no camera yet; expected it after Camera");
  description_.dicing_camera = {description_.camera, description_.film, description_.world_to_camera};
}

DescriptionBuilder::Scope DescriptionBuilder::begin_import() {
  return {state_, coordinate_systems_, std::exchange(stack_floor_, stack_.size())};
}

void DescriptionBuilder::end_import(Scope scope) {
  check_stack_closed();
  state_ = std::move(scope.state);
  coordinate_systems_ = std::move(scope.coordinate_systems);
  stack_floor_ = scope.stack_floor;
}

struct DescriptionBuilder::Checkpoint {
  size_t edits = 0;
  GraphicsState state;
  std::map<std::string, TransformPair> coordinate_systems;
  std::map<std::string, FileLoc> mentioned_media;
  ParamSet options;
  std::string base_directory;
  std::optional<DicingCameraEntity> dicing_camera;
  size_t stack = 0, stack_floor = 0;
  size_t materials = 0, textures = 0, media = 0, area_lights = 0, lights = 0, shapes = 0, objects = 0, instances = 0,
         placements = 0;
};

std::shared_ptr<const DescriptionBuilder::Checkpoint> DescriptionBuilder::checkpoint() {
  const SceneDescription& d = description_;
  has_checkpoint_ = true;
  editor_.reset_bound();
  return std::make_shared<const Checkpoint>(Checkpoint{
      edits_.size(), state_, coordinate_systems_, mentioned_media_, d.options, d.base_directory, d.dicing_camera,
      stack_.size(), stack_floor_, d.materials.size(), d.textures.size(), d.media.size(), d.area_lights.size(),
      d.lights.size(), d.shapes.size(), d.objects.size(), d.instances.size(), d.placements.size()});
}

void DescriptionBuilder::restore(const Checkpoint& c) {
  SceneDescription& d = description_;
  for (; edits_.size() > c.edits; edits_.pop_back()) edits_.back()();
  state_ = c.state;
  coordinate_systems_ = c.coordinate_systems;
  mentioned_media_ = c.mentioned_media;
  d.options = c.options;
  d.base_directory = c.base_directory;
  d.dicing_camera = c.dicing_camera;
  stack_.resize(std::min(stack_.size(), c.stack));
  stack_floor_ = c.stack_floor;
  active_object_ = -1;
  const auto forget = [](auto& names, size_t size) {
    std::erase_if(names, [size](const auto& n) { return size_t(n.second) >= size; });
  };
  d.materials.resize(c.materials), forget(d.named_materials, c.materials);
  d.textures.resize(c.textures), forget(d.float_textures, c.textures), forget(d.spectrum_textures, c.textures);
  d.media.resize(c.media), forget(d.named_media, c.media);
  d.objects.resize(c.objects), forget(d.named_objects, c.objects);
  d.area_lights.resize(c.area_lights);
  d.lights.resize(c.lights);
  d.shapes.resize(c.shapes);
  d.instances.erase(d.instances.begin() + std::ptrdiff_t(c.instances), d.instances.end());
  d.placements.resize(std::min(d.placements.size(), c.placements));
  std::erase_if(d.instance_names, [&](const auto& n) { return n.first >= c.instances; });
  material_defined_.resize(c.materials);
  object_defined_.resize(c.objects);
  editor_.forget();
}

namespace {

/// Measures how many objects stand inside of each other, and finds those that stand in themselves.
class ObjectLevels {
 public:
  explicit ObjectLevels(const std::vector<ObjectEntity>& objects)
      : objects_(objects), levels_(objects.size(), unknown) {}

  /// Of an object that is placed at `loc`: 1 where it holds no others.
  int of(int32_t object, const FileLoc& loc) {
    int& levels = levels_[size_t(object)];
    const ObjectEntity& o = objects_[size_t(object)];
    if (levels == under_way)
      throw InputError(loc, "object " + in_quotes(o.name) +
                                " holds itself: it is placed here inside of its own "
                                "definition, at " +
                                o.loc.to_string() + ", or in that of an object that it holds");
    if (levels != unknown) return levels;
    if (depth_ == most_object_levels) fail(loc);
    levels = under_way;
    ++depth_;
    int inside = 0;
    const auto visit = [&](const auto& placed) {
      for (const auto& i : placed) {
        inside = std::max(inside, of(i.object, i.loc));
        if (inside + 1 > most_object_levels) fail(i.loc);
      }
    };
    visit(o.instances), visit(o.placements);
    --depth_;
    return levels = inside + 1;
  }

 private:
  [[noreturn]] static void fail(const FileLoc& loc) {
    throw InputError(loc, "objects are placed in objects more than " + std::to_string(most_object_levels) + " deep");
  }
  static constexpr int unknown = 0, under_way = -1;
  const std::vector<ObjectEntity>& objects_;
  std::vector<int> levels_;
  int depth_ = 0;
};

}  // namespace

void DescriptionBuilder::check_levels() const {
  ObjectLevels levels(description_.objects);
  for (size_t i = 0; i < description_.objects.size(); ++i) levels.of(int32_t(i), description_.objects[i].loc);
}

void DescriptionBuilder::finish(const FileLoc& loc) {
  if (!in_world_) throw InputError(loc, "the file ends without WorldBegin");
  check_stack_closed();
  for (size_t i = 0; i < description_.materials.size(); ++i)
    if (!material_defined_[i])
      throw InputError(description_.materials[i].loc,
                       "material " + in_quotes(description_.materials[i].name) + " is not defined");
  for (size_t i = 0; i < description_.objects.size(); ++i)
    if (!object_defined_[i])
      throw InputError(description_.objects[i].loc,
                       "object " + in_quotes(description_.objects[i].name) + " is not defined");
  check_levels();
  for (const auto& [name, first_use] : mentioned_media_)
    if (!description_.named_media.contains(name))
      throw InputError(first_use, "medium " + in_quotes(name) + " is not defined");
}

}  // namespace dapple::scenefile
