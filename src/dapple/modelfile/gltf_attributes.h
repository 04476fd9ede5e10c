// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

namespace dapple::modelfile {

/// What Assimp would get wrong in a glTF file without a word.
struct GltfRepair {
  /// The bytes of the file with integer vertex attributes and animation values (normalized texture coordinates and
  /// weights of glTF 2.0, section 3.6.2.2; KHR_mesh_quantization) as floats in a further buffer, as Assimp takes all
  /// but colours and joints to be; and with the identities that skins without inverseBindMatrices have. Empty: there is
  /// nothing to do.
  std::string file;
  size_t lost_faces = 0;  ///< triangles with indices of vertices that are not there, which it leaves out
  std::string damage;     ///< gltf_damage(): if any, the file is not for Assimp
};

/// Of a .gltf or .glb file. `read` gives the bytes of a file that a buffer names, "" where there is none. What is
/// damaged stays as it is. Allocates as the file asks for: for run_in_child() only.
GltfRepair repair_gltf(const std::string& file, const std::function<std::string(const std::string& uri)>& read);

}  // namespace dapple::modelfile
