// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "dapple/modelfile/default_view.h"
#include "dapple/modelfile/model_reader.h"
#include "dapple/scenefile/scene_description.h"

namespace dapple::modelfile {

/// What may be said of a model from outside. Scene files have no use for it.
struct ModelOptions {
  ViewOptions view;
  ModelTime time;
  std::string camera;  ///< the name of one of the file's, or "default": none of them; empty: the first
  double unit = 0;     ///< metres of one unit of the file, which becomes the scene's; 0: as the file says, else 1
  std::optional<V2i> resolution;  ///< of the picture that the camera is set for
};

/// Reads a scene by its extension: a model (is_model_file()) becomes a scene with the camera and the lights of its
/// file, or those of ViewOptions, which an information says; all else is pbrt-v4's format, which may Import models.
/// Throws InputError.
scenefile::SceneDescription read_scene(const std::string& path, const ModelOptions& options, Diagnostics& diagnostics);

/// The meshes of a model at their places, as one without materials.
ModelMesh joined_meshes(const Model& model);

}  // namespace dapple::modelfile
