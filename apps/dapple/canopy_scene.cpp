// SPDX-License-Identifier: Apache-2.0
#include "canopy_scene.h"

#include <cmath>

#include "dapple/base/parallel.h"
#include "option_values.h"

namespace dapple::app {

V3f SkyAngles::direction() const {
  const double s = std::sin(zenith_deg * degree);
  return V3f(
      V3d(s * std::cos(azimuth_deg * degree), s * std::sin(azimuth_deg * degree), std::cos(zenith_deg * degree)));
}

SkyAngles angles_of(const std::string& option, const std::string& text) {
  const auto v = numbers_of(option, text, 2, "ZENITH,AZIMUTH in degrees");
  check_range(option + " zenith", v[0], 0, 89.9, " degrees");
  check_range(option + " azimuth", v[1], -360, 360, " degrees");
  return {v[0], v[1]};
}

void add_scene_options(CLI::App& command, CanopySceneOptions* o) {
  command.option_defaults()->always_capture_default();
  command.add_option("SCENE", o->scene, "Scene file (.pbrt, .pbrt.gz); z is up, metres")->required();
  command.add_option("--period", o->period, "X0,X1,Y0,Y1: repeat this part of the scene without end");
  command.add_option("--area", o->area, "X0,X1,Y0,Y1 of the plot; by default that of --period, or the whole scene's");
  command.add_flag("--strict", o->strict, "Whatever would be a warning about the scene is an error");
  command.add_flag("--keep-going", o->keep_going,
                   "Missing images, meshes and plug-ins become visible stand-ins instead of errors");
  add_threads(command, o->threads);
}

CanopyScene load_canopy_scene(const CanopySceneOptions& o, Diagnostics& diagnostics) {
  set_thread_count(o.threads);
  CanopyScene scene;
  if (!o.period.empty()) scene.period = rectangle("--period", o.period);
  Imath::Box2d area;  // empty: all of the scene
  if (scene.period) area = *scene.period;
  if (!o.area.empty()) area = rectangle("--area", o.area);
  scene.description = modelfile::read_scene(o.scene, {}, diagnostics);
  if (scene.description.camera.type.empty()) scene.description.camera.type = "perspective";  // none is needed
  build::BuildOptions options;
  options.keep_going = o.keep_going;
  options.period = scene.period;
  options.lod = 0;  // what is measured is all there is
  scene.built.emplace(build::build_scene(scene.description, options, diagnostics));
  const Box3f box = scene.built->scene->traced.bounds();
  if (box.isEmpty()) throw InputError(FileLoc{o.scene, 0, 0}, "the scene has no surfaces, expected a canopy");
  const V3d& origin = scene.built->origin;
  const Imath::V2d corner(origin.x, origin.y);
  scene.area = !area.isEmpty() ? Box2f(V2f(area.min - corner), V2f(area.max - corner))
                               : Box2f(V2f(box.min.x, box.min.y), V2f(box.max.x, box.max.y));
  if (!(scene.area.max.x > scene.area.min.x) || !(scene.area.max.y > scene.area.min.y))
    throw InputError(FileLoc{o.scene, 0, 0}, "the scene has no extent along x or y; expected a plot, or --area");
  return scene;
}

}  // namespace dapple::app
