// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/editable_scene.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "dapple/base/hash.h"
#include "dapple/base/timer.h"
#include "dapple/build/coverage.h"
#include "dapple/build/geometry_builder.h"
#include "dapple/build/glow_factory.h"
#include "dapple/build/light_factory.h"
#include "dapple/build/light_group_factory.h"
#include "dapple/build/material_factory.h"
#include "dapple/build/medium_factory.h"
#include "dapple/build/openpbr_factory.h"
#include "dapple/scene/lens_system.h"
#include "dapple/scenefile/named_files.h"

namespace dapple::build {

using Imath::V2d;
using scenefile::SceneDescription;

namespace {

/// The place of what no line of the scene is to blame for.
FileLoc whole(const SceneDescription& description) {
  return {description.files.empty() ? "" : std::string_view(description.files.front()), 0, 0};
}

bool same_view(const scene::Camera& a, const scene::Camera& b) {
  const auto key = [](const scene::Camera& camera) {
    const scene::Camera::Settings& s = camera.settings();
    return std::tuple(s.projection, s.fov_degrees, s.screen_min_x, s.screen_max_x, s.screen_min_y, s.screen_max_y,
                      s.lens_radius, s.focal_distance, s.time_open, s.time_close, s.resolution.x, s.resolution.y);
  };
  const auto &m = a.settings().camera_to_world, &n = b.settings().camera_to_world;
  return key(a) == key(b) && m.start() == n.start() && m.end() == n.end();
}

// Of these the geometry was made by what the material is.
bool shapes_geometry(const shading::Material& m) {
  return m.is_interface() || m.stages().has(shading::Stage::displacement) || m.stages().has(shading::Stage::opacity);
}

// Shapes that shine by their material, or are filled by it.
bool any_glows_or_fills(const SceneDescription& description) {
  return std::any_of(description.materials.begin(), description.materials.end(),
                     [](const auto& material) { return emission_of(material) || has_interior(material); });
}

}  // namespace

// What an update makes, aside until all of it is known to be right.
struct EditableScene::Parts {
  FilmRequest film;
  IntegratorRequest request;
  scene::Camera camera, dicing_camera;
  scene::Filter filter = scene::Filter::box(0.5f);
  std::vector<shading::MaterialPtr> materials;
  std::optional<AreaLightShapes::Lights> area_lights;          ///< none: they stay
  std::vector<std::unique_ptr<const emitters::Light>> lights;  ///< the others
  scene::LightGroups area_groups, light_groups;
};

EditableScene::EditableScene(const SceneDescription& description, const BuildOptions& options, Diagnostics& diagnostics)
    : description_(description), options_(options), diagnostics_(diagnostics) {
  build_all();
}

EditableScene::~EditableScene() = default;

void EditableScene::read_view(Parts* p) const {
  p->film = make_film(*context_, options_.film);
  p->request = make_integrator_request(*context_);
  p->camera = make_camera(*context_, p->film.film.resolution);
  p->dicing_camera = make_dicing_camera(*context_, options_.film, p->camera);
  if (const auto& lens = p->camera.settings().lens_system) p->film.film.scale *= lens->exposure();
  p->filter = make_filter(*context_);
  p->film.film.signed_weights = p->filter.has_negative_lobes();
}

void EditableScene::make_lights(Parts* p, const AreaLightShapes* areas) const {
  if (areas) p->area_lights = areas->make(*context_, *textures_);
  p->area_groups = p->light_groups = areas ? p->area_lights->groups : area_groups_;
  for (const scenefile::LightEntity& entity : description_.lights) {
    if (!entity.is_shown()) continue;
    const uint8_t group = read_light_group(entity, &p->light_groups);
    auto light = make_light(entity, *context_, *textures_);
    if (!light) continue;
    p->lights.push_back(std::move(light));
    p->light_groups.of_light.push_back(group);
  }
  p->light_groups.gains = read_gains(*context_, p->light_groups, options_.gains);
}

void EditableScene::set_lights(scene::Scene* scene, const AreaLightShapes& shapes, Parts* p) {
  scene->light_sampler.reset();
  scene->lights.resize(p->area_lights ? 0 : area_lights_);
  if (p->area_lights) {
    area_lights_ = p->area_lights->all.size();
    shapes.set(std::move(*p->area_lights), scene);
  }
  area_groups_ = std::move(p->area_groups);
  scene->infinite_lights.clear();
  scene->light_groups = std::move(p->light_groups);
  for (auto& light : p->lights) {
    if (light->is_infinite()) scene->infinite_lights.push_back(uint32_t(scene->lights.size()));
    scene->lights.push_back(std::move(light));
  }
  scene->glow = {};
  for (const GlowPlace& glow : glow_) {
    scene->glow.add(glow.medium, glow.place, uint32_t(scene->lights.size()));
    scene->light_groups.of_light.push_back(0);
    scene->lights.push_back(std::make_unique<emitters::GlowLight>(glow.cells));
  }
  const Box3f bounds = scene->traced.bounds();
  const float radius = bounds.isEmpty() ? 1.0f : std::max(0.5f * length(bounds.max - bounds.min), 1e-6f);
  std::vector<const emitters::Light*> all;
  for (const auto& light : scene->lights) all.push_back(light.get());
  if (!all.empty()) scene->light_sampler = std::make_unique<emitters::LightSampler>(all, radius);
}

// All of a scene but what its textures read: by context_ and textures_ as they are.
void EditableScene::build_scene_parts(BuiltScene& built) {
  built.named_files = scenefile::named_files(description_);
  built.temporary_files = description_.temporary_files;
  built.scene = std::make_unique<scene::Scene>(built_.scene.get());
  built.origin = context_->origins.scene;
  scene::Scene& scene = *built.scene;
  Parts parts;
  read_view(&parts);
  if (!textures_) textures_ = std::make_unique<TextureLibrary>(*context_);
  scene.materials = make_materials(*context_, *textures_);
  const CoverageMaterials coverage(*context_, &scene.materials);
  scene.media = make_media(*context_, *textures_);
  if (const auto& name = description_.camera_medium; !name.empty())
    scene.camera_medium = description_.named_media.at(name);
  description_.accelerator.params.report_unused("accelerator", diagnostics_);
  scene.film = parts.film.film;
  scene.camera = parts.camera;
  scene.filter = parts.filter;

  std::optional<Box2f> period;
  if (options_.period) {
    const V2d corner(built.origin.x, built.origin.y);
    period = Box2f(V2f(options_.period->min - corner), V2f(options_.period->max - corner));
    scene.traced.set_period(*period);
  }
  AreaLightShapes area_lights;
  const float lod = options_.lod.value_or(scene_level_of_detail(*context_));
  GeometryBuilder geometry(*context_, *textures_, coverage, parts.dicing_camera, scene, area_lights, period,
                           period ? 0 : lod);
  geometry.build();
  built.times.shape_seconds = geometry.shape_seconds();
  built.times.shape_bytes = geometry.shape_bytes();
  built.times.pruned = geometry.pruned();
  scene.fingerprint = hash(description_.fingerprint, geometry.fingerprint());
  scene.traced.commit();
  geometry.check_reach(scene.traced.bounds(), scene.camera.position());
  built.times.acceleration_seconds = scene.traced.build_seconds();
  make_lights(&parts, &area_lights);
  glow_ = find_glow(scene);
  set_lights(&scene, area_lights, &parts);
  area_light_shapes_ = std::move(area_lights);
  glowing_materials_ = any_glows_or_fills(description_);
  built.film = std::move(parts.film);
  built.request = std::move(parts.request);
  built.dicing_camera = parts.dicing_camera;
}

void EditableScene::build_all() {
  const Timer timer;
  BuiltScene built;
  built.texture_system = std::make_unique<image::TextureSystem>();
  auto context =
      std::make_unique<BuildContext>(BuildContext{description_, diagnostics_, *built.texture_system,
                                                  options_.keep_going, find_origins(description_, diagnostics_)});
  // Errors come in the order in which things are made; until all are, the old ones stay.
  std::swap(context_, context);
  auto textures = std::move(textures_);
  try {
    build_scene_parts(built);
  } catch (...) {
    textures_ = std::move(textures);
    context_ = std::move(context);
    throw;
  }
  built.times.total_seconds = timer.seconds();
  std::swap(built_, built);
  warn_of_emptiness();
}

// False where textures would not be what they are: their places are less the scene's origin, and where pictures cut
// out, what is made of them goes by shapes.
bool EditableScene::build_geometry() {
  const Timer timer;
  if (built_.scene->materials.size() != description_.materials.size()) return false;
  const Origins origins = find_origins(description_, diagnostics_);
  if (origins.scene != context_->origins.scene || origins.objects != context_->origins.objects) return false;
  BuiltScene built;
  build_scene_parts(built);
  built.texture_system = std::move(built_.texture_system);
  built.times.total_seconds = timer.seconds();
  std::swap(built_, built);
  warn_of_emptiness();
  return true;
}

void EditableScene::warn_of_emptiness() const {
  const scene::Scene& scene = *built_.scene;
  const auto has_shape = [&](const scenefile::InstanceEntity& i) {
    const auto& object = description_.objects[size_t(i.object)];
    return !object.shapes.empty() || object.holds_objects();
  };
  if (description_.shapes.empty() && description_.placements.empty() &&
      std::none_of(description_.instances.begin(), description_.instances.end(), has_shape))
    diagnostics_.warn(whole(description_), "the scene has no shape", "no shape");
  const bool glows = std::any_of(scene.media.begin(), scene.media.end(), [](const auto& m) { return m && m->emits(); });
  if (scene.lights.empty() && !glows)
    diagnostics_.warn(whole(description_), "the scene has no light: only ambient occlusion will show anything",
                      "no light");
}

// False where the geometry has to be made again with them.
bool EditableScene::make_materials_again(Parts* p) const {
  const auto& before = built_.scene->materials;
  p->materials = make_materials(*context_, *textures_);
  const CoverageMaterials coverage(*context_, &p->materials);
  if (p->materials.size() != before.size() || before.size() != description_.materials.size()) return false;
  if (glowing_materials_ || any_glows_or_fills(description_)) return false;
  for (size_t i = 0; i < before.size(); ++i)
    if (shapes_geometry(*before[i]) || shapes_geometry(*p->materials[i])) return false;
  return true;
}

std::vector<std::string> EditableScene::built_files() const {
  return scenefile::named_files(description_);
}

std::vector<RGB> EditableScene::described_gains() const {
  return read_gains(*context_, built_.scene->light_groups, options_.gains);
}

IntegratorRequest EditableScene::described_request() const {
  return make_integrator_request(*context_);
}

namespace {
std::vector<bool> emitters_of(const scene::Scene& scene) {
  std::vector<bool> emit;
  for (const auto& binding : scene.bindings) emit.push_back(binding.first_light != trace::no_id);
  return emit;
}
}  // namespace

Changes EditableScene::update(Changes changes) {
  if (!changes.any()) return changes;
  Parts parts;
  const bool view = changes.camera || changes.settings;
  if (view && !changes.all) read_view(&parts);
  if (view && !changes.all && !same_view(parts.dicing_camera, built_.dicing_camera)) changes.all = true;
  // Where the eye is inside of a medium that glows decides what its lights are.
  const int32_t medium = built_.scene ? built_.scene->camera_medium : scene::vacuum;
  if (changes.camera && medium != scene::vacuum && built_.scene->media[size_t(medium)]->emits()) changes.all = true;
  if (changes.materials && !changes.all && !make_materials_again(&parts)) changes.geometry = true;
  if (changes.area_lights && !changes.all && !area_light_shapes_.can_make_again(description_)) changes.geometry = true;
  if (changes.geometry && !changes.all && !build_geometry()) changes.all = true;
  if (changes.all) build_all();
  if (changes.all || changes.geometry) return changes;
  const bool lights = changes.lights || changes.area_lights;
  if (lights) make_lights(&parts, changes.area_lights ? &area_light_shapes_ : nullptr);
  scene::Scene& scene = *built_.scene;
  if (changes.gains && !lights) scene.light_groups.gains = described_gains();
  if (view) {
    scene.film = parts.film.film;
    scene.camera = parts.camera;
    scene.filter = parts.filter;
    built_.film = std::move(parts.film);
    built_.request = std::move(parts.request);
  }
  if (changes.materials) scene.materials = std::move(parts.materials);
  if (lights) {
    const std::vector<bool> emitted = emitters_of(scene);
    set_lights(&scene, area_light_shapes_, &parts);
    changes.emitters = emitters_of(scene) != emitted;
    warn_of_emptiness();
  }
  return changes;
}

Changes EditableScene::update(Changes changes, const FilmOverrides& film) {
  const FilmOverrides before = std::exchange(options_.film, film);
  try {
    return update(changes);
  } catch (...) {
    options_.film = before;
    throw;
  }
}

}  // namespace dapple::build
