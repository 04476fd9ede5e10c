// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/scene_difference.h"

#include <algorithm>

namespace dapple::build {

using scenefile::Entity;
using scenefile::Param;
using scenefile::ParamSet;
using scenefile::SceneDescription;
using scenefile::TransformPair;

namespace {

bool same(const Param& a, const Param& b) {
  return a.type == b.type && a.name == b.name && a.numbers == b.numbers && a.exact == b.exact && a.base == b.base &&
         a.integers == b.integers && a.strings == b.strings && a.color_space == b.color_space;
}

bool same_params(const ParamSet& a, const ParamSet& b) {
  const auto equal = [](const Param& p, const Param& q) { return same(p, q); };
  const auto& x = a.all();
  const auto& y = b.all();
  if (!std::equal(x.begin(), x.end(), y.begin(), y.end(), equal)) return false;
  if (!a.defaults() || !b.defaults()) return a.defaults() == b.defaults();
  return same_params(*a.defaults(), *b.defaults());
}

bool same(const TransformPair& a, const TransformPair& b) {
  return a.start == b.start && a.end == b.end;
}

bool same_entity(const Entity& a, const Entity& b) {
  return a.type == b.type && a.presence == b.presence && same_params(a.params, b.params);
}

bool same(const Entity& a, const Entity& b) {
  return same_entity(a, b);
}
bool same(const scenefile::MaterialEntity& a, const scenefile::MaterialEntity& b) {
  return a.name == b.name && same_entity(a, b);
}
bool same(const scenefile::TextureEntity& a, const scenefile::TextureEntity& b) {
  return a.name == b.name && a.is_spectrum == b.is_spectrum && same(a.transform, b.transform) && same_entity(a, b);
}
bool same(const scenefile::MediumEntity& a, const scenefile::MediumEntity& b) {
  return a.name == b.name && same(a.transform, b.transform) && same_entity(a, b);
}
bool same(const scenefile::LightEntity& a, const scenefile::LightEntity& b) {
  return a.medium == b.medium && same(a.transform, b.transform) && same_entity(a, b);
}
bool same(const scenefile::ShapeEntity& a, const scenefile::ShapeEntity& b) {
  return same(a.transform, b.transform) && a.reverse_orientation == b.reverse_orientation && a.material == b.material &&
         a.area_light == b.area_light && a.inside_medium == b.inside_medium && a.outside_medium == b.outside_medium &&
         same_entity(a, b);
}
bool same(const scenefile::LightGroupEntity& a, const scenefile::LightGroupEntity& b) {
  return a.name == b.name && same_entity(a, b);
}
bool same(const scenefile::InstanceEntity& a, const scenefile::InstanceEntity& b) {
  return a.object == b.object && a.presence == b.presence && a.transform == b.transform;
}

bool same(const scenefile::PlacementsEntity& a, const scenefile::PlacementsEntity& b) {
  return a.object == b.object && a.filename == b.filename && a.transform == b.transform;
}

bool same(const scenefile::ObjectEntity& a, const scenefile::ObjectEntity& b);

template <class T>
bool same_list(const std::vector<T>& a, const std::vector<T>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const T& x, const T& y) { return same(x, y); });
}

bool same(const scenefile::ObjectEntity& a, const scenefile::ObjectEntity& b) {
  return a.name == b.name && same_list(a.shapes, b.shapes) && same_list(a.instances, b.instances) &&
         same_list(a.placements, b.placements);
}

bool same_dicing(const SceneDescription& a, const SceneDescription& b) {
  if (!a.dicing_camera || !b.dicing_camera) return !a.dicing_camera && !b.dicing_camera;
  return same(a.dicing_camera->camera, b.dicing_camera->camera) && same(a.dicing_camera->film, b.dicing_camera->film) &&
         same(a.dicing_camera->world_to_camera, b.dicing_camera->world_to_camera);
}

}  // namespace

Changes difference(const SceneDescription& a, const SceneDescription& b) {
  Changes c;
  c.camera = !same(a.camera, b.camera) || !same(a.world_to_camera, b.world_to_camera) ||
             a.shutter_start_transform_time != b.shutter_start_transform_time ||
             a.shutter_end_transform_time != b.shutter_end_transform_time;
  c.settings = !same(a.film, b.film) || !same(a.sampler, b.sampler) || !same(a.integrator, b.integrator) ||
               !same(a.pixel_filter, b.pixel_filter) || !same_dicing(a, b);
  c.lights = !same_list(a.lights, b.lights);
  c.gains = !same_list(a.light_groups, b.light_groups);
  c.area_lights = !same_list(a.area_lights, b.area_lights);
  c.materials = !same_list(a.materials, b.materials);
  c.all = a.base_directory != b.base_directory || !same_params(a.options, b.options) ||
          !same(a.color_space, b.color_space) || !same(a.accelerator, b.accelerator) ||
          a.camera_medium != b.camera_medium || a.materials.size() != b.materials.size() ||
          !same_list(a.textures, b.textures) || !same_list(a.media, b.media) ||
          a.area_lights.size() != b.area_lights.size();
  c.geometry = !same_list(a.shapes, b.shapes) || !same_list(a.objects, b.objects) ||
               !same_list(a.instances, b.instances) || !same_list(a.placements, b.placements);
  return c;
}

}  // namespace dapple::build
