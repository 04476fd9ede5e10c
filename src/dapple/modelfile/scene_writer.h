// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "dapple/scenefile/scene_description.h"

namespace dapple::modelfile {

struct WrittenScene {
  std::string folder;  ///< of what the scene names
  size_t shapes = 0, meshes = 0, pictures = 0;
};

/// Writes a description as a scene file, readable by people and, as far as it holds no extensions, by pbrt-v4. Meshes
/// become PLY files, and pictures from inside of models copies, in the folder NAME_files beside NAME.pbrt; other
/// pictures are named where they are. Numbers are written so that reading gives the same floats. IoError.
WrittenScene write_scene(const scenefile::SceneDescription& description, const std::string& path);

}  // namespace dapple::modelfile
