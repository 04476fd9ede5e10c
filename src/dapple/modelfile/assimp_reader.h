// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <assimp/scene.h>

#include <string>

#include "dapple/modelfile/model.h"
#include "dapple/modelfile/model_reader.h"

namespace dapple::modelfile {

/// All of a file by Assimp. It may crash, hang or take any memory on hostile files: for run_in_child() only. Throws
/// std::runtime_error with Assimp's reason.
Model read_by_assimp(const std::string& path, const ModelTime& time);

// Its parts.
ModelMaterial convert_material(const aiMaterial& material, const aiScene& scene, bool is_gltf);
void convert_lights(const aiScene& scene, bool is_gltf, Model* model);

inline V3d to_v3d(const aiVector3D& v) {
  return V3d(double(v.x), double(v.y), double(v.z));
}
inline RGB to_rgb(const aiColor3D& c) {
  const auto part = [](ai_real x) { return x > 0 && x < 1e30f ? float(x) : 0.0f; };
  return RGB(part(c.r), part(c.g), part(c.b));
}
M44d to_rows(const aiMatrix4x4& m);

}  // namespace dapple::modelfile
