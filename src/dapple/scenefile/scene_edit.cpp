// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/scene_edit.h"

#include <algorithm>
#include <optional>

#include "dapple/scenefile/group_names.h"
#include "dapple/scenefile/text.h"

namespace dapple::scenefile {

namespace {

Transform matrix_of(const ParamSet& params, std::string_view name) {
  const std::vector<double> m = params.get_doubles(name);
  const FileLoc loc = params.find(name)->loc;
  if (m.size() != 16)
    throw InputError(loc, "\"" + std::string(name) +
                              "\": expected the 16 numbers of a matrix as Transform takes them, found " +
                              std::to_string(m.size()));
  const Transform t(
      M44d(m[0], m[4], m[8], m[12], m[1], m[5], m[9], m[13], m[2], m[6], m[10], m[14], m[3], m[7], m[11], m[15]));
  if (!t.is_finite() || !t.is_invertible() || !t.inverse().is_finite())
    throw InputError(loc, "\"" + std::string(name) + "\": the matrix is singular or not finite");
  return t;
}

Transform view_of(const ParamSet& params) {
  const std::vector<double> v = params.get_doubles("lookat");
  const FileLoc loc = params.find("lookat")->loc;
  if (v.size() != 9)
    throw InputError(loc, "\"lookat\": expected the 9 numbers that LookAt takes, found " + std::to_string(v.size()));
  const Transform t = Transform::look_at({v[0], v[1], v[2]}, {v[3], v[4], v[5]}, {v[6], v[7], v[8]});
  if (!t.is_finite() || !t.is_invertible())
    throw InputError(loc,
                     "\"lookat\": eye and look must differ, and up must not be parallel to the direction between "
                     "them");
  return t.inverse();
}

bool is_affine(const Transform& t) {
  const M44d& m = t.matrix();
  return m[3][0] == 0 && m[3][1] == 0 && m[3][2] == 0 && m[3][3] == 1;
}

constexpr size_t most_work = size_t(1) << 21;
constexpr size_t most_groups = 256;  // of which something is said, whether a light is of them or not

}  // namespace

// Parameters that are not the item's own.
struct SceneEditor::Special {
  std::optional<Transform> transform, move;
  std::optional<Presence> presence;
  std::string type, material;
  MaterialIndex material_index = -1;
  std::vector<std::string_view> taken;  // names of them

  Special(EditTarget target, const ParamSet& p) {
    using T = EditTarget;
    const bool placed = target == T::light || target == T::shape || target == T::object || target == T::texture ||
                        target == T::medium || target == T::camera;
    const auto given = [&](const char* name, bool applies) {
      if (!applies || !p.find(name)) return false;
      taken.push_back(name);
      return true;
    };
    if (given("transform", placed)) transform = matrix_of(p, "transform");
    if (given("lookat", target == T::camera)) transform = view_of(p);
    if (given("move", placed)) move = matrix_of(p, "move");
    if (given("visible", target == T::shape || target == T::object))
      presence = p.get_bool("visible", true) ? Presence::shown : Presence::hidden;
    if (given("on", target == T::light)) presence = p.get_bool("on", true) ? Presence::shown : Presence::hidden;
    if (given("type", target == T::material || !has_name(target))) type = p.get_string("type", "");
    if (given("material", target == T::shape)) material = p.get_string("material", "");
  }
};

void SceneEditor::add_name(EditTarget target, const std::string& name, Place place) {
  auto& list = index_.names[size_t(target)][name];
  if (list.empty()) index_.order[size_t(target)].push_back(name);
  list.push_back(place);
}

template <class E>
void SceneEditor::add_item(EditTarget target, const E& entity, const std::string& prefix, Place place) {
  const std::string counted = prefix + (entity.type.empty() ? "interface" : entity.type);
  const int32_t number = ++index_.counts[std::string(edit_target_names[size_t(target)]) + "/" + counted];
  const std::string& own = entity.params.item_name();
  add_name(target, own.empty() ? counted + ":" + std::to_string(number) : own, place);
}

void SceneEditor::update_index() {
  using T = EditTarget;
  Index& x = index_;
  for (; x.lights < d_.lights.size(); ++x.lights) add_item(T::light, d_.lights[x.lights], "", {int32_t(x.lights)});
  for (; x.area_lights < d_.area_lights.size(); ++x.area_lights)
    add_item(T::light, d_.area_lights[x.area_lights], "", {int32_t(x.area_lights), -1, true});
  for (; x.shapes < d_.shapes.size(); ++x.shapes) add_item(T::shape, d_.shapes[x.shapes], "", {int32_t(x.shapes)});
  const auto add_shapes_of = [&](size_t o) {
    const auto& shapes = d_.objects[o].shapes;
    for (size_t& i = x.shapes_of_object[o]; i < shapes.size(); ++i)
      add_item(T::shape, shapes[i], d_.objects[o].name + "/", {int32_t(i), int32_t(o)});
  };
  const size_t seen = x.shapes_of_object.size();
  x.shapes_of_object.resize(d_.objects.size());
  for (const size_t o : x.begun) add_shapes_of(o);
  if (x.begun.size() > 1) x.begun.erase(x.begun.begin(), x.begun.end() - 1);  // the last may still grow
  for (size_t o = seen; o < d_.objects.size(); ++o) add_shapes_of(o);
  for (; x.instances < d_.instances.size(); ++x.instances) {
    const std::string& definition = d_.objects[size_t(d_.instances[x.instances].object)].name;
    const int32_t number = ++x.counts["object/" + definition];
    const auto named = d_.instance_names.find(uint32_t(x.instances));
    const Place place{int32_t(x.instances)};
    add_name(T::object, named != d_.instance_names.end() ? named->second : definition + ":" + std::to_string(number),
             place);
    x.names[size_t(T::object)][definition].push_back(place);  // not in the order: one of all
  }
  // [0] is pbrt's default, which all that have none share.
  for (; x.materials < d_.materials.size(); ++x.materials) {
    const MaterialEntity& m = d_.materials[x.materials];
    if (!m.name.empty())
      add_name(T::material, m.name, {int32_t(x.materials)});
    else if (x.materials > 0)
      add_item(T::material, m, "", {int32_t(x.materials)});
  }
  for (; x.textures < d_.textures.size(); ++x.textures)
    add_name(T::texture, d_.textures[x.textures].name, {int32_t(x.textures)});
  for (; x.media < d_.media.size(); ++x.media) add_name(T::medium, d_.media[x.media].name, {int32_t(x.media)});
}

Entity* SceneEditor::entity_at(EditTarget target, Place place) {
  const size_t i = size_t(place.item);
  switch (target) {
    case EditTarget::light:
      return place.is_area_light ? &d_.area_lights[i] : &d_.lights[i];
    case EditTarget::shape:
      return place.object < 0 ? &d_.shapes[i] : &d_.objects[size_t(place.object)].shapes[i];
    case EditTarget::object:
      return nullptr;
    case EditTarget::material:
      return &d_.materials[i];
    case EditTarget::texture:
      return &d_.textures[i];
    case EditTarget::medium:
      return &d_.media[i];
    case EditTarget::group:
      return &d_.light_groups[i];
    case EditTarget::camera:
      return &d_.camera;
    case EditTarget::film:
      return &d_.film;
    case EditTarget::integrator:
      return &d_.integrator;
    case EditTarget::sampler:
      return &d_.sampler;
  }
  return nullptr;
}

TransformPair* SceneEditor::transform_at(EditTarget target, Place place) {
  const size_t i = size_t(place.item);
  switch (target) {
    case EditTarget::light:
      return place.is_area_light ? nullptr : &d_.lights[i].transform;
    case EditTarget::shape:
      return place.object < 0 ? &d_.shapes[i].transform : &d_.objects[size_t(place.object)].shapes[i].transform;
    case EditTarget::texture:
      return &d_.textures[i].transform;
    case EditTarget::medium:
      return &d_.media[i].transform;
    default:
      return nullptr;
  }
}

Presence SceneEditor::presence_at(EditTarget target, Place place) {
  if (target == EditTarget::object) return d_.instances[size_t(place.item)].presence;
  return entity_at(target, place)->presence;
}

void SceneEditor::set_presence(EditTarget target, Place place, Presence presence, std::vector<Undo>* undo) {
  const auto slot = [this, target, place]() -> Presence& {
    return target == EditTarget::object ? d_.instances[size_t(place.item)].presence
                                        : entity_at(target, place)->presence;
  };
  undo->push_back([slot, before = slot()] { slot() = before; });
  slot() = presence;
}

void SceneEditor::set_transform(EditTarget target, Place place, const Special& special, std::vector<Undo>* undo) {
  if (!special.transform && !special.move) return;
  const auto edited = [&](TransformPair t) {
    if (special.transform) t = {*special.transform, *special.transform};
    if (special.move) t = {*special.move * t.start, *special.move * t.end};
    return t;
  };
  if (target == EditTarget::object) {
    InstanceEntity& instance = d_.instances[size_t(place.item)];
    const TransformPair before = instance.transform.exact();
    instance.transform = CompactTransform(edited(before));
    undo->push_back([this, place, before] { d_.instances[size_t(place.item)].transform = CompactTransform(before); });
    return;
  }
  const bool is_camera = target == EditTarget::camera;
  TransformPair& slot = is_camera ? d_.world_to_camera : *transform_at(target, place);
  undo->push_back([this, target, place, is_camera, before = slot] {
    (is_camera ? d_.world_to_camera : *transform_at(target, place)) = before;
  });
  if (is_camera) {
    const TransformPair placed = edited({slot.start.inverse(), slot.end.inverse()});
    slot = {placed.start.inverse(), placed.end.inverse()};
  } else {
    slot = edited(slot);
  }
}

void SceneEditor::set_params(EditTarget target, Place place, const SceneEdit& edit, const Special& special,
                             std::vector<Undo>* undo) {
  Entity& entity = *entity_at(target, place);
  if (!special.type.empty()) {
    undo->push_back([this, target, place, before = entity.type] { entity_at(target, place)->type = before; });
    entity.type = special.type;
  }
  if (entity.loc.line == 0) {  // the scene had no such directive
    undo->push_back([this, target, place, before = entity.loc] { entity_at(target, place)->loc = before; });
    entity.loc = edit.loc;
  }
  if (special.material_index >= 0) {
    auto& shape = static_cast<ShapeEntity&>(entity);
    undo->push_back([this, target, place, before = shape.material] {
      static_cast<ShapeEntity*>(entity_at(target, place))->material = before;
    });
    shape.material = special.material_index;
  }
  for (const Param& p : edit.params.all()) {
    if (std::find(special.taken.begin(), special.taken.end(), p.name) != special.taken.end()) continue;
    const bool takes_out = p.numbers.empty() && p.integers.empty() && p.strings.empty();
    auto before =
        std::make_shared<std::optional<Param>>(takes_out ? entity.params.take(p.name) : entity.params.replace(p));
    undo->push_back([this, target, place, name = p.name, before] {
      ParamSet& params = entity_at(target, place)->params;
      if (*before)
        params.replace(std::move(**before));
      else
        params.take(name);
    });
  }
}

const std::vector<SceneEditor::Place>& SceneEditor::find(const SceneEdit& edit) {
  static const std::vector<Place> the_only(1);
  if (!has_name(edit.target)) return the_only;
  if (edit.target == EditTarget::group) return find_group(edit);
  update_index();
  const auto& names = index_.names[size_t(edit.target)];
  const auto found = names.find(edit.name);
  if (found != names.end() && std::any_of(found->second.begin(), found->second.end(), [&](const Place& p) {
        return presence_at(edit.target, p) != Presence::removed;
      }))
    return found->second;
  refuse_name(edit);
}

// One of which nothing was said yet gets an entity, which says nothing.
const std::vector<SceneEditor::Place>& SceneEditor::find_group(const SceneEdit& edit) {
  auto& groups = d_.light_groups;
  auto it = std::find_if(groups.begin(), groups.end(), [&](const LightGroupEntity& g) { return g.name == edit.name; });
  if (!edit.declares && (it == groups.end() || it->params.empty())) {
    work_ += (d_.lights.size() + d_.area_lights.size()) / 16;
    const std::vector<std::string> there = group_names(d_);
    if (std::find(there.begin(), there.end(), edit.name) == there.end()) refuse_name(edit);
  }
  if (it == groups.end()) {
    if (groups.size() == most_groups)
      throw InputError(edit.loc, "light group " + in_quotes(edit.name, 100) + " is one too many; expected at most " +
                                     std::to_string(most_groups) + " names");
    it = groups.emplace(groups.end());
    it->name = edit.name;
    it->loc = edit.loc;
  }
  group_place_ = {{int32_t(it - groups.begin())}};
  return group_place_;
}

void SceneEditor::refuse_name(const SceneEdit& edit) {
  const std::vector<std::string> there = this->names(edit.target);
  const std::vector<std::string_view> views(there.begin(), there.end());
  auto near = closest_names(edit.name, views);
  if (near.empty() && views.size() <= 12) near = views;
  throw InputError(edit.loc, "no " + std::string(edit_target_names[size_t(edit.target)]) + " is called " +
                                 in_quotes(edit.name, 100) + (near.empty() ? "" : "; " + one_of(near)));
}

void SceneEditor::check(const SceneEdit& edit, const Special& special, const std::vector<Place>& places) {
  using T = EditTarget;
  const auto refuse = [&](const std::string& why) { throw InputError(edit.loc, why); };
  const std::string what = std::string(edit_target_names[size_t(edit.target)]) + " " + in_quotes(edit.name, 100);
  if (edit.params.find("name")) refuse("an edit cannot change the name of " + what);
  if (edit.remove) {
    if (edit.target != T::light && edit.target != T::shape && edit.target != T::object)
      refuse("Remove takes lights, shapes and objects, not a " + std::string(edit_target_names[size_t(edit.target)]));
    return;
  }
  if (edit.target == T::object)
    for (const Param& p : edit.params.all())
      if (std::find(special.taken.begin(), special.taken.end(), p.name) == special.taken.end())
        throw InputError(
            p.loc, "an object has no parameter " + in_quotes(p.name) + "; " + one_of({"transform", "move", "visible"}));
  if (edit.target == T::group)
    for (const Param& p : edit.params.all())
      if (p.name != "gain")
        throw InputError(p.loc, "a group of lights has no parameter " + in_quotes(p.name) + "; expected gain");
  for (const auto* t : {&special.transform, &special.move})
    if (edit.target == T::object && *t && !is_affine(**t))
      refuse("the transform of an object must be affine: its last row must be 0 0 0 1");
  for (const Place& p : places) {
    if (edit.target == T::light && p.is_area_light && (special.transform || special.move))
      refuse(what + " is an area light, which moves with its shapes; edit those");
    if (edit.target == T::material && !special.type.empty() && d_.materials[size_t(p.item)].name.empty())
      refuse("only materials that have a name can change their type");
  }
}

SceneEditor::Undo SceneEditor::apply(SceneEdit edit) {
  if (edit.remove && !edit.params.empty()) throw InputError(edit.params.all()[0].loc, "Remove takes no parameters");
  const std::vector<Place>& places = find(edit);
  Special special(edit.target, edit.params);
  check(edit, special, places);
  if (!special.material.empty()) {
    const auto& materials = index_.names[size_t(EditTarget::material)];
    const auto it = materials.find(special.material);
    if (it == materials.end())
      throw InputError(edit.loc, "no material is called " + in_quotes(special.material, 100) + "; " + one_of([&] {
                                   const auto& order = index_.order[size_t(EditTarget::material)];
                                   return std::vector<std::string_view>(order.begin(), order.end());
                                 }()));
    special.material_index = it->second.front().item;
  }
  if (edit.remove) special.presence = Presence::removed;
  size_t values = 0;
  for (const Param& p : edit.params.all()) values += p.numbers.size() + p.integers.size() + p.strings.size();
  work_ += places.size() * (1 + values / 16);
  if (work_ > most_work)
    throw InputError(edit.loc, "there are implausibly many edits: things were edited more than " +
                                   std::to_string(most_work) + " times; expected fewer, or names of fewer things");
  std::vector<Undo> undo;
  for (const Place& place : places) {
    if (has_name(edit.target) && presence_at(edit.target, place) == Presence::removed) continue;
    if (special.presence) set_presence(edit.target, place, *special.presence, &undo);
    set_transform(edit.target, place, special, &undo);
    if (edit.target != EditTarget::object) set_params(edit.target, place, edit, special, &undo);
  }
  return [undo = std::move(undo)] {
    for (size_t i = undo.size(); i-- > 0;) undo[i]();
  };
}

bool SceneEditor::names_area_light(const std::string& light) {
  update_index();
  const auto& names = index_.names[size_t(EditTarget::light)];
  const auto found = names.find(light);
  return found != names.end() &&
         std::any_of(found->second.begin(), found->second.end(), [](const Place& p) { return p.is_area_light; });
}

const Param* SceneEditor::parameter(EditTarget target, const std::string& name, std::string_view param) {
  SceneEdit edit;
  edit.target = target, edit.name = name;
  for (const Place& place : find(edit)) {
    if (has_name(target) && presence_at(target, place) == Presence::removed) continue;
    const Entity* const entity = entity_at(target, place);
    if (!entity) return nullptr;
    for (const ParamSet* set : {&entity->params, entity->params.defaults().get()})
      if (set)
        for (const Param& p : set->all())
          if (p.name == param) return &p;
    return nullptr;
  }
  return nullptr;
}

std::vector<std::string> SceneEditor::names(EditTarget target) {
  if (target == EditTarget::group) return group_names(d_);
  update_index();
  std::vector<std::string> names;
  for (const std::string& name : index_.order[size_t(target)]) {
    const auto& places = index_.names[size_t(target)].at(name);
    if (std::any_of(places.begin(), places.end(),
                    [&](const Place& p) { return presence_at(target, p) != Presence::removed; }))
      names.push_back(name);
  }
  return names;
}

}  // namespace dapple::scenefile
