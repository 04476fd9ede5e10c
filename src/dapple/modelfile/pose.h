// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <assimp/scene.h>

#include <string>
#include <unordered_map>
#include <vector>

#include "dapple/base/vec.h"

namespace dapple::modelfile {

/// Where the nodes of a scene are at a time, and its meshes with their bones and morph targets.
class Pose {
 public:
  /// `seconds` below 0: as the file has them.
  Pose(const aiScene& scene, double seconds);

  /// From the node's space to that of the scene.
  const aiMatrix4x4& global(const aiNode& node) const { return globals_.at(&node); }
  const aiNode* find(const std::string& name) const;

  /// True if the mesh has bones or targets.
  static bool deforms(const aiMesh& mesh) { return mesh.mNumBones > 0 || mesh.mNumAnimMeshes > 0; }
  /// Vertices and normals of a mesh at a node: in the scene's space where it has bones, else in that of the node.
  void deform(const aiMesh& mesh, const aiNode& node, std::vector<V3f>* P, std::vector<V3f>* N) const;

 private:
  void place(const aiNode& node, const aiMatrix4x4& parent, const aiAnimation* animation, double ticks);
  std::vector<float> weights_of(const aiMesh& mesh, const aiNode& node) const;

  const aiScene& scene_;
  const aiAnimation* animation_ = nullptr;
  double ticks_ = 0;
  std::unordered_map<const aiNode*, aiMatrix4x4> globals_;
  std::unordered_map<std::string, const aiNode*> by_name_;
  std::unordered_map<std::string, const aiNodeAnim*> channels_;
};

}  // namespace dapple::modelfile
