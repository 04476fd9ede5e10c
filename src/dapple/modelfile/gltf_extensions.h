// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "dapple/modelfile/model.h"

namespace dapple::modelfile {

/// Adds to the materials of a glTF file (.gltf or .glb) what Assimp does not read of them: KHR_materials_iridescence,
/// _anisotropy, _volume, the colour of _specular. Extensions that have no counterpart go to ModelMaterial::left_out by
/// their names. Materials are matched by name; those that share one with another are left as they are, and say so. A
/// file that is no JSON adds nothing: Assimp has judged it. Allocates as the file asks for: for run_in_child() only.
void add_gltf_extensions(const std::string& path, Model* model);

}  // namespace dapple::modelfile
