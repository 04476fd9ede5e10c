// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "dapple/modelfile/scene_reader.h"

namespace dapple::app {

/// What the command line says of a model.
struct ModelRequest {
  std::string view_from, look_at, camera, sky, up, ground;
  double fov = 0, unit = 0, time = -1, shutter = 0;
  std::optional<int> frame;
};

void add_model_options(CLI::App& app, ModelRequest* request);

/// UsageError for what makes no sense; a warning where `scene` is no model and something is asked for.
modelfile::ModelOptions model_options(const ModelRequest& request, const std::string& scene);

}  // namespace dapple::app
