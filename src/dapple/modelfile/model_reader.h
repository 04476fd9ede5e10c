// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "dapple/base/error.h"
#include "dapple/modelfile/child_process.h"
#include "dapple/modelfile/model.h"

namespace dapple::modelfile {

/// At which time an animated model is read, in seconds from the start of its animation. A negative time is the pose in
/// which the file has it.
struct ModelTime {
  double open = -1;
  double shutter = 0;  ///< how long the shutter stays open from then on; 0: nothing moves
};

/// True if the name ends like that of a model file that Assimp reads (.gltf, .glb, .obj, .fbx, .dae, .stl, .ply and the
/// others in any case).
bool is_model_file(const std::string& path);

/// Reads a model in a child process. Files beside it (materials, buffers) are read from regular files only. InputError
/// at `loc` where the file is missing, damaged, or needs more than `limits`; there is none where it holds no mesh.
Model read_model(const std::string& path, const ModelTime& time, const FileLoc& loc);
Model read_model(const std::string& path, const ModelTime& time, const FileLoc& loc, const ChildLimits& limits);

}  // namespace dapple::modelfile
