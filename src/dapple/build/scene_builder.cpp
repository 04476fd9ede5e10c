// SPDX-License-Identifier: Apache-2.0
#include "dapple/build/scene_builder.h"

#include <algorithm>

#include "dapple/base/hash.h"
#include "dapple/base/timer.h"
#include "dapple/build/coverage.h"
#include "dapple/build/geometry_builder.h"
#include "dapple/build/light_factory.h"
#include "dapple/build/light_group_factory.h"
#include "dapple/build/material_factory.h"
#include "dapple/build/medium_factory.h"
#include "dapple/build/texture_factory.h"
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

}  // namespace

BuiltScene::~BuiltScene() {
  scene.reset();
}

BuiltScene build_scene(const SceneDescription& description, const BuildOptions& options, Diagnostics& diagnostics) {
  const Timer timer;
  BuiltScene built;
  built.named_files = scenefile::named_files(description);
  built.temporary_files = description.temporary_files;
  built.texture_system = std::make_unique<image::TextureSystem>();
  built.scene = std::make_unique<scene::Scene>();
  scene::Scene& scene = *built.scene;
  const BuildContext context{description, diagnostics, *built.texture_system, options.keep_going,
                             find_origins(description, diagnostics)};
  built.origin = context.origins.scene;

  built.film = make_film(context, options.film);
  built.request = make_integrator_request(context);
  scene.film = built.film.film;
  scene.camera = make_camera(context, scene.film.resolution);
  if (const auto& lens = scene.camera.settings().lens_system) scene.film.scale *= lens->exposure();
  scene.filter = make_filter(context);
  const TextureLibrary textures(context);
  scene.materials = make_materials(context, textures);
  const CoverageMaterials coverage(context, &scene.materials);
  scene.media = make_media(context, textures);
  if (const auto& name = description.camera_medium; !name.empty())
    scene.camera_medium = description.named_media.at(name);
  description.accelerator.params.report_unused("accelerator", diagnostics);

  std::optional<Box2f> period;
  if (options.period) {
    const V2d corner(built.origin.x, built.origin.y);
    period = Box2f(V2f(options.period->min - corner), V2f(options.period->max - corner));
    scene.traced.set_period(*period);
  }
  GeometryBuilder geometry(context, textures, coverage, scene, period);
  geometry.build();
  built.times.shape_seconds = geometry.shape_seconds();
  built.times.shape_bytes = geometry.shape_bytes();
  scene.fingerprint = hash(description.fingerprint, geometry.fingerprint());
  scene.traced.commit();
  geometry.check_reach(scene.traced.bounds(), scene.camera.position());
  built.times.acceleration_seconds = scene.traced.build_seconds();

  for (const scenefile::LightEntity& entity : description.lights) {
    const uint8_t group = read_light_group(entity, &scene.light_groups);
    auto light = make_light(entity, context, textures);
    if (!light) continue;
    if (light->is_infinite()) scene.infinite_lights.push_back(uint32_t(scene.lights.size()));
    scene.lights.push_back(std::move(light));
    scene.light_groups.of_light.push_back(group);
  }
  const auto has_shape = [&](const scenefile::InstanceEntity& i) {
    return !description.objects[size_t(i.object)].shapes.empty();
  };
  if (description.shapes.empty() && std::none_of(description.instances.begin(), description.instances.end(), has_shape))
    diagnostics.warn(whole(description), "the scene has no shape");
  const bool glows = std::any_of(scene.media.begin(), scene.media.end(), [](const auto& m) { return m && m->emits(); });
  if (scene.lights.empty() && !glows)
    diagnostics.warn(whole(description), "the scene has no light: only ambient occlusion will show anything");
  const Box3f bounds = scene.traced.bounds();
  const float radius = bounds.isEmpty() ? 1.0f : std::max(0.5f * length(bounds.max - bounds.min), 1e-6f);
  std::vector<const emitters::Light*> lights;
  for (const auto& light : scene.lights) lights.push_back(light.get());
  if (!lights.empty()) scene.light_sampler = std::make_unique<emitters::LightSampler>(lights, radius);
  built.times.total_seconds = timer.seconds();
  return built;
}

BuiltScene load_scene(const std::string& path, const BuildOptions& options, Diagnostics& diagnostics) {
  const Timer timer;
  modelfile::ModelOptions model = options.model;
  if (!model.resolution) model.resolution = options.film.resolution;
  const SceneDescription description = modelfile::read_scene(path, model, diagnostics);
  const double parse_seconds = timer.seconds();
  BuiltScene built = build_scene(description, options, diagnostics);
  built.times.parse_seconds = parse_seconds;
  built.times.total_seconds += parse_seconds;
  return built;
}

}  // namespace dapple::build
