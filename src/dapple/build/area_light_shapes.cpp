// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/area_light_shapes.h"

#include <algorithm>
#include <numeric>

#include "dapple/build/light_factory.h"
#include "dapple/build/light_group_factory.h"
#include "dapple/build/openpbr_factory.h"

namespace dapple::build {

using scenefile::Entity;
using scenefile::ShapeEntity;
using trace::no_id;

namespace {

const char* name_of(const trace::Shape& shape) {
  if (std::holds_alternative<trace::CurvesPtr>(shape)) return "curve";
  return std::holds_alternative<trace::DisksPtr>(shape) ? "cloud of disks" : "diced surface";
}

bool emits(const ShapeEntity& e, const scenefile::SceneDescription& description) {
  return e.area_light < 0 || description.emits(e);
}

}  // namespace

void AreaLightShapes::make(const Item& item, const Entity& emission, const BuildContext& context,
                           const TextureLibrary& textures, Lights* to) const {
  const FileLoc& loc = context.description.shapes[item.entity].loc;
  if (const auto* mesh = std::get_if<trace::MeshPtr>(&item.shape); mesh && !(*mesh)->P_end.empty())
    context.diagnostics.unsupported(loc, "an area light on a mesh that deforms",
                                    "light from where it is at shutter open");
  std::vector<uint32_t> emitter_of;
  auto emitters = make_joined_emitters(item.shape, &emitter_of);
  // A pattern over u, v lies on each triangle by itself, and power is that of each.
  const scenefile::Param* L = emission.params.find("L");
  if (item.alpha || emission.params.find("filename") || (L && L->type == scenefile::ParamType::texture) ||
      emission.params.find("power") || emission.params.find("shader")) {
    emitters = make_emitters(item.shape);
    std::iota(emitter_of.begin(), emitter_of.end(), 0u);
  }
  if (emitters.empty()) {
    context.diagnostics.unsupported(loc, std::string("an area light on a ") + name_of(item.shape),
                                    "a surface that does not shine");
    return;
  }
  const uint8_t group = read_light_group(emission, &to->groups);
  auto lights = make_area_lights(emission, std::move(emitters), item.alpha, item.motion, context, textures, loc);
  to->first_light.back() = uint32_t(to->table.size());
  std::vector<uint32_t> numbers;
  for (auto& light : lights) {
    numbers.push_back(light ? uint32_t(to->all.size()) : no_id);
    if (!light) continue;
    to->all.push_back(std::move(light));
    to->groups.of_light.push_back(group);
  }
  for (const uint32_t emitter : emitter_of) to->table.push_back(numbers[emitter]);
}

AreaLightShapes::Lights AreaLightShapes::make(const BuildContext& context, const TextureLibrary& textures) const {
  Lights lights;
  for (const Item& item : items_) {
    const ShapeEntity& e = context.description.shapes[item.entity];
    lights.first_light.push_back(no_id);
    if (!emits(e, context.description)) continue;
    if (e.area_light >= 0)
      make(item, context.description.area_lights[size_t(e.area_light)], context, textures, &lights);
    else if (const auto glow = emission_of(context.description.materials[size_t(e.material)]))
      make(item, *glow, context, textures, &lights);
  }
  return lights;
}

void AreaLightShapes::set(Lights lights, scene::Scene* scene) const {
  scene->lights = std::move(lights.all);
  scene->light_table = std::move(lights.table);
  scene->light_groups = std::move(lights.groups);
  for (size_t i = 0; i < items_.size(); ++i) scene->bindings[items_[i].geometry].first_light = lights.first_light[i];
}

bool AreaLightShapes::can_make_again(const scenefile::SceneDescription& description) const {
  return std::all_of(items_.begin(), items_.end(), [&](const Item& item) {
    return emits(description.shapes[item.entity], description) == item.emits || (!item.alpha && !item.motion);
  });
}

}  // namespace dapple::build
