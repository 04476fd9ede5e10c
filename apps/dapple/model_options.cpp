// SPDX-License-Identifier: Apache-2.0
#include "model_options.h"

#include <cmath>
#include <cstdio>

#include "dapple/base/error.h"
#include "dapple/base/log.h"

namespace dapple::app {

namespace {

constexpr double frames_a_second = 24;

V3d place(const std::string& option, const std::string& text) {
  V3d v;
  int end = 0;
  if (std::sscanf(text.c_str(), "%lf,%lf,%lf%n", &v.x, &v.y, &v.z, &end) != 3 || size_t(end) != text.size() ||
      !std::isfinite(v.x + v.y + v.z))
    throw UsageError(option + ": \"" + text + "\"; expected a place, such as 0,1,0");
  return v;
}

}  // namespace

void add_model_options(CLI::App& app, ModelRequest* r) {
  app.add_option("--view-from", r->view_from,
                 "Models: a side (quarter, front, back, left, right, above, below) or a place X,Y,Z "
                 "[the file's camera, else quarter]");
  app.add_option("--look-at", r->look_at, "Models: X,Y,Z in the middle of the picture [the middle of the model]");
  app.add_option("--fov", r->fov, "Models: degrees across the shorter side of the picture [the file's, else 35]");
  app.add_option("--camera", r->camera, "Models: a camera of the file by its name; default = none of them [the first]");
  app.add_option("--sky", r->sky,
                 "Models: clear (with sun), overcast, uniform, none, or an image file, in place of the file's lights "
                 "[clear where the file has none]");
  app.add_option("--ground", r->ground, "Models: a plane under the model, with a sky: on, off [on]")
      ->check(CLI::IsMember({"on", "off"}));
  app.add_option("--up", r->up, "Models: the axis of the file that is up: x, y, z, -x, -y, -z [as its format has it]");
  app.add_option("--unit", r->unit, "Models: metres of one unit of the file [as the file says, else 1]");
  app.add_option("--time", r->time, "Models: seconds of the animation [the pose of the file]");
  app.add_option("--frame", r->frame, "Models: the same in frames of 1/24 s");
  app.add_option("--shutter", r->shutter, "Models: seconds that the shutter is open from then on: motion blur [0]");
}

modelfile::ModelOptions model_options(const ModelRequest& r, const std::string& scene) {
  modelfile::ModelOptions o;
  if (!modelfile::is_model_file(scene)) {
    const bool asked = !r.view_from.empty() || !r.look_at.empty() || !r.camera.empty() || !r.sky.empty() ||
                       !r.up.empty() || !r.ground.empty() || r.fov != 0 || r.unit != 0 || r.time >= 0 || r.frame ||
                       r.shutter != 0;
    if (asked) log_warning("options of models (--view-from and the like) have no effect: \"" + scene + "\" is a scene");
    return o;
  }
  o.view.from = r.view_from;
  if (!r.look_at.empty()) o.view.look_at = place("--look-at", r.look_at);
  o.view.fov = r.fov;
  o.view.sky = r.sky;
  o.view.up = r.up;
  o.view.ground = r.ground != "off";
  modelfile::check_view_options(o.view);
  o.camera = r.camera;
  if (!std::isfinite(r.unit) || r.unit < 0) throw UsageError("--unit must be above 0");
  o.unit = r.unit;
  if (r.frame && r.time >= 0) throw UsageError("--frame and --time exclude each other");
  if (!std::isfinite(r.time) || !(r.shutter >= 0) || !std::isfinite(r.shutter))
    throw UsageError("--time and --shutter are seconds, 0 or more");
  o.time.open = r.frame ? *r.frame / frames_a_second : r.time;
  o.time.shutter = r.shutter;
  if (o.time.shutter > 0 && o.time.open < 0) o.time.open = 0;
  return o;
}

}  // namespace dapple::app
