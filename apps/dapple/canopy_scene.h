// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "dapple/build/scene_builder.h"

namespace dapple::app {

/// What `dapple canopy reflect` and `measure` share: a scene of which only a part counts. z is up, metres.
struct CanopySceneOptions {
  std::string scene, period, area;
  bool strict = false, keep_going = false;
  int threads = 0;
};
void add_scene_options(CLI::App& command, CanopySceneOptions* o);

struct CanopyScene {
  scenefile::SceneDescription description;
  std::optional<build::BuiltScene> built;
  std::optional<Imath::Box2d> period;
  Box2f area;  ///< the plot, less the scene's origin

  /// In the coordinates of the file.
  std::array<double, 4> area_m() const {
    const V3d& o = built->origin;
    return {area.min.x + o.x, area.max.x + o.x, area.min.y + o.y, area.max.y + o.y};
  }
};
/// UsageError for options out of range, InputError for the scene.
CanopyScene load_canopy_scene(const CanopySceneOptions& o, Diagnostics& diagnostics);

/// A place in the sky, or from which a plot is seen.
struct SkyAngles {
  double zenith_deg = 0, azimuth_deg = 0;
  V3f direction() const;  ///< unit
};
/// "ZENITH,AZIMUTH" of an option: zenith 0 to 89.9, azimuth -360 to 360 degrees.
SkyAngles angles_of(const std::string& option, const std::string& text);

}  // namespace dapple::app
