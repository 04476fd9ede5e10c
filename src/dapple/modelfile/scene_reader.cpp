// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/scene_reader.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "dapple/base/log.h"
#include "dapple/modelfile/model_importer.h"
#include "dapple/modelfile/param_list.h"
#include "dapple/scenefile/description_builder.h"

namespace dapple::modelfile {

using scenefile::DescriptionBuilder;
using scenefile::SceneDescription;

namespace {

constexpr V2i default_resolution(1280, 720);

const ModelCamera* choose_camera(const Model& model, const std::string& name, const FileLoc& loc) {
  if (name == "default" || (name.empty() && model.cameras.empty())) return nullptr;
  if (name.empty()) return &model.cameras.front();
  std::vector<std::string_view> names{"default"};
  for (const ModelCamera& c : model.cameras) {
    if (c.name == name) return &c;
    names.push_back(c.name);
  }
  throw InputError(loc, "the model has no camera \"" + name + "\"; " + one_of(names));
}

V2i resolution_of(const ModelCamera* camera, const ModelOptions& options) {
  if (options.resolution) return *options.resolution;
  if (!camera || !(camera->aspect > 0.05 && camera->aspect < 20)) return default_resolution;
  return V2i(std::max(1, int(std::lround(default_resolution.y * camera->aspect))), default_resolution.y);
}

void add_camera(const Model& model, const ModelCamera* camera, double scale, const ModelOptions& options,
                const FileLoc& loc, SceneDescription* description, DescriptionBuilder* builder) {
  const V2i size = resolution_of(camera, options);
  const double aspect = double(size.x) / size.y;
  const View view = camera ? view_of(*camera, scale, aspect, false) : default_view(model, scale, options.view, aspect);
  const View end = camera ? view_of(*camera, scale, aspect, true) : view;
  const Transform at_start = view.world_to_camera(), at_end = end.world_to_camera();
  if (at_start == at_end) {
    builder->concat(at_start, loc);
  } else {
    builder->active_transform(true, false);
    builder->concat(at_start, loc);
    builder->active_transform(false, true);
    builder->concat(at_end, loc);
    builder->active_transform(true, true);
  }
  const double fov = camera && options.view.fov > 0 ? options.view.fov : view.fov;
  builder->camera(Directive("perspective", loc).number("fov", fov).take());
  Directive film("rgb", loc);
  film.integer("xresolution", size.x).integer("yresolution", size.y);
  description->film = film.take();
}

std::string axis_name(const V3d& up) {
  for (int k = 0; k < 3; ++k)
    if (std::abs(up[k]) > 0.5) return std::string(up[k] < 0 ? "-" : "") + char('x' + k);
  return "y";
}

void say_what_was_chosen(const std::string& path, const Model& model, const ModelCamera* camera, bool own_lights,
                         bool sky, double scale, const ModelOptions& options) {
  std::string text = path + ": ";
  if (camera)
    text += "camera \"" + camera->name + "\" of the file (--camera)";
  else
    text += "seen from " + (options.view.from.empty() ? std::string("the front quarter") : options.view.from) +
            " (--view-from, --look-at, --fov)";
  if (own_lights)
    text += ", lit by the lights of the file (--sky)";
  else
    text += !sky ? ", without a light (--sky)"
                 : ", lit by sky \"" + (options.view.sky.empty() ? std::string("clear") : options.view.sky) + "\"" +
                       (options.view.ground ? " over a ground (--sky, --ground)" : " (--sky, --ground)");
  text += "; " + axis_name(axes_of(options.view, model.z_up).up) + " is up (--up)";
  if (scale != 1) text += ", in metres of " + std::to_string(scale) + " (--unit)";
  if (model.animations > 0 && options.time.open < 0)
    text += ", at rest: there are " + std::to_string(model.duration) + " s of animation (--time)";
  log_info(text);
}

SceneDescription read_model_scene(const std::string& path, const ModelOptions& options, Diagnostics& diagnostics) {
  SceneDescription description;
  description.files.push_back(path);
  const size_t slash = path.rfind('/');
  if (slash != std::string::npos) description.base_directory = path.substr(0, std::max<size_t>(slash, 1));
  const FileLoc loc{description.files.front(), 0, 0};
  Model model = read_model(path, options.time, loc);
  const ModelCamera* const chosen = choose_camera(model, options.view.from.empty() ? options.camera : "default", loc);
  const std::optional<ModelCamera> camera = chosen ? std::optional(*chosen) : std::nullopt;
  const double scale = options.unit > 0 ? options.unit : model.metres > 0 ? model.metres : 1;
  for (ModelMaterial& m : model.materials) m.attenuation_distance *= float(scale);
  const Axes axes = axes_of(options.view, model.z_up);

  DescriptionBuilder builder(&description, &diagnostics);
  add_camera(model, chosen, scale, options, loc, &description, &builder);
  builder.world_begin();
  Model outline;  // what is said of it after it is gone
  outline.z_up = model.z_up, outline.animations = model.animations, outline.duration = model.duration;
  Imath::Box3d bounds = bounds_of(model);
  if (!bounds.isEmpty()) bounds = Imath::Box3d(bounds.min * scale, bounds.max * scale);
  const bool own_lights = !model.lights.empty() && options.view.sky.empty();
  if (!own_lights) model.lights.clear();
  builder.attribute_begin(loc);
  if (scale != 1) builder.concat(Transform::scale(V3d(scale, scale, scale)), loc);
  emit_model(std::move(model), description.files.front(), "", loc, &description, &builder, &diagnostics);
  builder.attribute_end(loc);
  const bool sky = !own_lights && add_default_light(bounds, options.view, axes, loc, &description, &builder);
  builder.finish(loc);
  say_what_was_chosen(path, outline, camera ? &*camera : nullptr, own_lights, sky, scale, options);
  return description;
}

}  // namespace

SceneDescription read_scene(const std::string& path, const ModelOptions& options, Diagnostics& diagnostics) {
  if (is_model_file(path)) return read_model_scene(path, options, diagnostics);
  ModelImporter importer;
  return scenefile::read_pbrt(path, diagnostics, &importer);
}

ModelMesh joined_meshes(const Model& model) {
  ModelMesh out;
  bool has_normals = true, has_uv = true;
  for (const ModelNode& n : model.nodes)
    for (const uint32_t m : n.meshes) {
      has_normals = has_normals && !model.meshes[m].N.empty();
      has_uv = has_uv && !model.meshes[m].uv[0].empty();
    }
  for (const ModelNode& node : model.nodes) {
    const Transform place(node.start);
    if (!place.is_finite() || !place.is_invertible()) continue;
    const bool mirrored = place.swaps_handedness();
    for (const uint32_t m : node.meshes) {
      const ModelMesh& mesh = model.meshes[m];
      const int32_t first = int32_t(out.P.size());
      for (const V3f& p : mesh.P) out.P.push_back(place.point(p));
      if (has_normals)
        for (const V3f& n : mesh.N) out.N.push_back(place.normal(n));
      if (has_uv) out.uv[0].insert(out.uv[0].end(), mesh.uv[0].begin(), mesh.uv[0].end());
      for (size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
        const int32_t a = mesh.indices[i] + first, b = mesh.indices[i + 1] + first, c = mesh.indices[i + 2] + first;
        for (const int32_t v : {a, mirrored ? c : b, mirrored ? b : c}) out.indices.push_back(v);
      }
    }
  }
  return out;
}

}  // namespace dapple::modelfile
