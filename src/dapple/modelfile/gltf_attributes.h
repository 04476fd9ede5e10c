// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

namespace dapple::modelfile {

/// The bytes of a glTF file (.gltf or .glb) whose integer vertex attributes and animation values (normalized texture
/// coordinates and weights of glTF 2.0, section 3.6.2.2; KHR_mesh_quantization) are floats in a further buffer, as
/// Assimp takes all but colours and joints to be. `read` gives the bytes of a file that a buffer names, "" where there
/// is none. Empty where there is nothing to do, and where the file is damaged: Assimp says how. Allocates as the file
/// asks for: for run_in_child() only.
std::string with_float_attributes(const std::string& file,
                                  const std::function<std::string(const std::string& uri)>& read);

}  // namespace dapple::modelfile
