// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <map>
#include <set>

#include "commands.h"
#include "dapple/base/log.h"
#include "dapple/base/timer.h"
#include "dapple/build/scene_builder.h"
#include "dapple/scenefile/scene_edit.h"
#include "interrupts.h"
#include "model_options.h"
#include "option_values.h"

namespace dapple::app {

namespace {

// Lights of Light directives stand in no geometry's table.
size_t emitting_primitives(const scene::Scene& scene) {
  std::set<uint32_t> lights(scene.light_table.begin(), scene.light_table.end());
  lights.erase(trace::no_id);
  return lights.size();
}

struct InfoOptions {
  std::string scene;
  std::string lod;
  bool strict = false, keep_going = false, names = false;
  ModelRequest model;
};

template <class Items>
std::string count_types(const Items& items) {
  std::map<std::string, size_t> counts;
  for (const auto& item : items) ++counts[item.type.empty() ? "interface" : item.type];
  std::string text;
  for (const auto& [type, count] : counts) text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + type;
  return text.empty() ? "none" : text;
}

struct Primitives {
  size_t triangles = 0, quads = 0, quadrics = 0, curve_segments = 0, disks = 0, patches = 0, micropolygons = 0;
};

Primitives count_primitives(const trace::TracedScene& traced) {
  Primitives n;
  for (uint32_t g = 0; g < traced.geometry_count(); ++g) {
    const trace::Shape& shape = traced.shape(g);
    if (const auto* mesh = std::get_if<trace::MeshPtr>(&shape))
      ((*mesh)->corners == 3 ? n.triangles : n.quads) += (*mesh)->face_count();
    else if (const auto* curves = std::get_if<trace::CurvesPtr>(&shape))
      n.curve_segments += (*curves)->segment_count();
    else if (const auto* disks = std::get_if<trace::DisksPtr>(&shape))
      n.disks += (*disks)->disks.size();
    else if (const auto* grids = std::get_if<trace::GridsPtr>(&shape))
      n.patches += (*grids)->grids.size(), n.micropolygons += (*grids)->micropolygon_count();
    else
      ++n.quadrics;
  }
  return n;
}

std::string megabytes(size_t bytes) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f MB", double(bytes) / 1e6);
  return text;
}

void line(const char* name, const std::string& value) {
  std::printf("%-14s %s\n", name, value.c_str());
}

// By which Edit finds them; of thousands the first.
void show_names(scenefile::SceneDescription* description, bool all) {
  constexpr size_t most = 12;
  scenefile::SceneEditor editor(description);
  using enum scenefile::EditTarget;
  for (const auto target : {light, shape, object, material, texture, medium, group}) {
    const std::vector<std::string> names = editor.names(target);
    std::string text;
    for (size_t i = 0; i < names.size() && (all || i < most); ++i) text += (i > 0 ? ", " : "") + names[i];
    if (!all && names.size() > most) text += ", and " + std::to_string(names.size() - most) + " more (--names)";
    if (!names.empty()) line((std::string(scenefile::edit_target_names[size_t(target)]) + " names").c_str(), text);
  }
}

int show(const InfoOptions& o) {
  Interrupts interrupts("result");
  Diagnostics diagnostics(o.strict);
  auto description = modelfile::read_scene(o.scene, model_options(o.model, o.scene), diagnostics);
  build::BuildOptions options;
  options.keep_going = o.keep_going;
  options.lod = level_of_detail_option(o.lod);
  const build::BuiltScene built = build::build_scene(description, options, diagnostics);
  const scene::Scene& scene = *built.scene;

  std::vector<scenefile::ShapeEntity> shapes = description.shapes;
  for (const auto& object : description.objects)
    shapes.insert(shapes.end(), object.shapes.begin(), object.shapes.end());
  const Primitives n = count_primitives(scene.traced);
  const V2i r = scene.film.resolution;
  const Box3f box = scene.traced.bounds();

  line("scene", o.scene);
  const build::IntegratorRequest request = built.request.over(build::preset_request(built.request.preset));
  line("film", std::to_string(r.x) + " x " + std::to_string(r.y) + ", " + std::to_string(*request.pixel_samples) +
                   " samples a pixel");
  line("integrator",
       built.request.type + (built.request.bounces ? ", bounces " + std::to_string(*built.request.bounces)
                                                   : ", maxdepth " + std::to_string(*built.request.max_depth)));
  line("camera", description.camera.type.empty() ? "perspective" : description.camera.type);
  line("shapes", count_types(shapes));
  line("primitives", std::to_string(n.triangles) + " triangles, " + std::to_string(n.quads) + " quads, " +
                         std::to_string(n.quadrics) + " quadrics, " + std::to_string(n.curve_segments) +
                         " curve segments, " + (n.disks ? std::to_string(n.disks) + " disks, " : "") +
                         std::to_string(n.patches) + " diced patches of " + std::to_string(n.micropolygons) +
                         " micropolygons");
  line("objects", std::to_string(description.objects.size()) + " definitions, " +
                      std::to_string(scene.traced.instance_count()) + " instances");
  if (scene.traced.instance_count() > scene.traced.single_count()) {
    const trace::PlacementTree& placements = scene.traced.placements();
    size_t placed = 0;
    for (uint32_t owner = 0; owner < scene.traced.object_count(); ++owner)
      for (const auto* set : placements.sets_of(owner)) placed += set->placements.size();
    for (const auto* set : placements.sets_of(trace::no_id)) placed += set->placements.size();
    line("placements", std::to_string(placed) + " in " + std::to_string(placements.levels(trace::no_id)) + " levels, " +
                           megabytes(placements.bytes()));
  }
  char bounds[160];
  const V3d& origin = built.origin;
  const V3d least = V3d(box.min) + origin, most = V3d(box.max) + origin;
  const bool is_far = origin != V3d(0, 0, 0);
  std::snprintf(bounds, sizeof bounds, is_far ? "%.10g %.10g %.10g to %.10g %.10g %.10g" : "%g %g %g to %g %g %g",
                least.x, least.y, least.z, most.x, most.y, most.z);
  line("bounds", box.isEmpty() ? "empty" : bounds);
  std::snprintf(bounds, sizeof bounds, "%.10g %.10g %.10g", origin.x, origin.y, origin.z);
  if (is_far) line("origin", bounds);
  line("materials", count_types(description.materials));
  line("textures", count_types(description.textures));
  line("lights",
       count_types(description.lights) + "; " + std::to_string(emitting_primitives(scene)) + " emitting primitives");
  line("media", count_types(description.media));
  show_names(&description, o.names);
  if (const vegetation::PruningCounts& p = built.times.pruned; p.components > 0)
    line("pruned", std::to_string(p.kept) + " of " + std::to_string(p.components) + " parts kept, " +
                       std::to_string(p.faces_kept) + " of " + std::to_string(p.faces) + " faces, " +
                       megabytes(p.bytes_kept) + " of " + megabytes(p.bytes) + " shapes");
  line("memory", megabytes(built.times.shape_bytes) + " shapes, " + megabytes(scene.traced.acceleration_bytes()) +
                     " acceleration, " + megabytes(process_peak_rss_bytes()) + " peak");
  const auto unsupported = diagnostics.unsupported_features();
  if (unsupported.empty()) line("unsupported", "nothing");
  for (const std::string& feature : unsupported) line("unsupported", feature);
  return static_cast<int>(ExitCode::done);
}

}  // namespace

Command add_info(CLI::App& app) {
  auto o = std::make_shared<InfoOptions>();
  app.add_option("SCENE", o->scene, "Scene (.pbrt, .pbrt.gz) or model (.glb, .obj, .fbx, ...)")->required();
  add_model_options(app, &o->model);
  app.add_option("--lod", o->lod, "Level of detail, as in render: off, auto, or pixels [the scene's; off]")
      ->check(level_of_detail_check());
  app.add_flag("--strict", o->strict, "Whatever would be a warning about the scene is an error");
  app.add_flag("--keep-going", o->keep_going,
               "Missing images, meshes and plug-ins become visible stand-ins instead of errors");
  app.add_flag("--names", o->names, "All names by which Edit finds things, not the first of each kind");
  return [o] { return show(*o); };
}

}  // namespace dapple::app
