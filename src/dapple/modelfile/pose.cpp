// SPDX-License-Identifier: Apache-2.0
#include "dapple/modelfile/pose.h"

#include <algorithm>
#include <cmath>

namespace dapple::modelfile {

namespace {

V3f to_v3f(const aiVector3D& v) {
  return V3f(float(v.x), float(v.y), float(v.z));
}

// The keys around a time, and the share of the second.
template <class Key>
std::pair<size_t, float> find_key(const Key* keys, size_t count, double ticks, size_t* next) {
  const Key* const end = keys + count;
  const Key* after = std::upper_bound(keys, end, ticks, [](double t, const Key& k) { return t < k.mTime; });
  if (after == keys) {
    *next = 0;
    return {0, 0.0f};
  }
  const Key* const before = after - 1;
  if (after == end) {
    *next = count - 1;
    return {count - 1, 0.0f};
  }
  *next = size_t(after - keys);
  const double span = after->mTime - before->mTime;
  return {size_t(before - keys), span > 0 ? float((ticks - before->mTime) / span) : 0.0f};
}

aiVector3D at(const aiVectorKey* keys, unsigned count, double ticks, const aiVector3D& fallback) {
  if (count == 0 || !keys) return fallback;
  size_t next = 0;
  const auto [i, f] = find_key(keys, count, ticks, &next);
  return keys[i].mValue * (1 - f) + keys[next].mValue * f;
}

aiQuaternion at(const aiQuatKey* keys, unsigned count, double ticks, const aiQuaternion& fallback) {
  if (count == 0 || !keys) return fallback;
  size_t next = 0;
  const auto [i, f] = find_key(keys, count, ticks, &next);
  aiQuaternion q;
  aiQuaternion::Interpolate(q, keys[i].mValue, keys[next].mValue, f);
  return q.Normalize();
}

}  // namespace

Pose::Pose(const aiScene& scene, double seconds) : scene_(scene) {
  if (seconds >= 0 && scene.mNumAnimations > 0) {
    animation_ = scene.mAnimations[0];
    const double rate = animation_->mTicksPerSecond > 0 ? animation_->mTicksPerSecond : 25;
    ticks_ = seconds * rate;
    for (unsigned i = 0; i < animation_->mNumChannels; ++i)
      channels_.emplace(animation_->mChannels[i]->mNodeName.C_Str(), animation_->mChannels[i]);
  }
  place(*scene.mRootNode, aiMatrix4x4(), animation_, ticks_);
}

void Pose::place(const aiNode& node, const aiMatrix4x4& parent, const aiAnimation* animation, double ticks) {
  aiMatrix4x4 local = node.mTransformation;
  const auto channel = animation ? channels_.find(node.mName.C_Str()) : channels_.end();
  if (channel != channels_.end()) {
    const aiNodeAnim& c = *channel->second;
    aiVector3D scale, position;
    aiQuaternion rotation;
    local.Decompose(scale, rotation, position);
    local = aiMatrix4x4(at(c.mScalingKeys, c.mNumScalingKeys, ticks, scale),
                        at(c.mRotationKeys, c.mNumRotationKeys, ticks, rotation),
                        at(c.mPositionKeys, c.mNumPositionKeys, ticks, position));
  }
  const aiMatrix4x4 global = parent * local;
  globals_[&node] = global;
  by_name_.emplace(node.mName.C_Str(), &node);
  for (unsigned i = 0; i < node.mNumChildren; ++i) place(*node.mChildren[i], global, animation, ticks);
}

const aiNode* Pose::find(const std::string& name) const {
  const auto it = by_name_.find(name);
  return it == by_name_.end() ? nullptr : it->second;
}

std::vector<float> Pose::weights_of(const aiMesh& mesh, const aiNode& node) const {
  std::vector<float> weights(mesh.mNumAnimMeshes, 0.0f);
  for (unsigned i = 0; i < mesh.mNumAnimMeshes; ++i) weights[i] = mesh.mAnimMeshes[i]->mWeight;
  if (!animation_) return weights;
  for (unsigned c = 0; c < animation_->mNumMorphMeshChannels; ++c) {
    const aiMeshMorphAnim& channel = *animation_->mMorphMeshChannels[c];
    const std::string name = channel.mName.C_Str();
    if ((name != mesh.mName.C_Str() && name != node.mName.C_Str()) || channel.mNumKeys == 0) continue;
    size_t next = 0;
    const auto [i, f] = find_key(channel.mKeys, channel.mNumKeys, ticks_, &next);
    std::fill(weights.begin(), weights.end(), 0.0f);
    const auto add = [&](const aiMeshMorphKey& key, float share) {
      for (unsigned k = 0; k < key.mNumValuesAndWeights; ++k)
        if (key.mValues[k] < weights.size()) weights[key.mValues[k]] += share * float(key.mWeights[k]);
    };
    add(channel.mKeys[i], 1 - f);
    add(channel.mKeys[next], f);
  }
  return weights;
}

void Pose::deform(const aiMesh& mesh, const aiNode& node, std::vector<V3f>* P, std::vector<V3f>* N) const {
  const size_t n = mesh.mNumVertices;
  P->resize(n);
  for (size_t i = 0; i < n; ++i) (*P)[i] = to_v3f(mesh.mVertices[i]);
  N->resize(mesh.mNormals ? n : 0);
  for (size_t i = 0; i < N->size(); ++i) (*N)[i] = to_v3f(mesh.mNormals[i]);
  const std::vector<float> weights = weights_of(mesh, node);
  for (size_t k = 0; k < weights.size(); ++k) {
    const aiAnimMesh& target = *mesh.mAnimMeshes[k];
    if (weights[k] == 0 || target.mNumVertices != n) continue;
    for (size_t i = 0; target.mVertices && i < n; ++i)
      (*P)[i] += to_v3f(target.mVertices[i] - mesh.mVertices[i]) * weights[k];
    for (size_t i = 0; target.mNormals && i < N->size(); ++i)
      (*N)[i] += to_v3f(target.mNormals[i] - mesh.mNormals[i]) * weights[k];
  }
  if (mesh.mNumBones == 0) return;
  // Vertices are a mean of where each bone takes them, weighted; those of no bone go with the node.
  std::vector<V3f> placed(n, V3f(0, 0, 0)), normals(N->size(), V3f(0, 0, 0));
  std::vector<float> sums(n, 0.0f);
  const auto add = [&](const aiMatrix4x4& m, size_t v, float w) {
    const aiMatrix3x3 linear(m);
    const V3f p = (*P)[v];
    placed[v] += to_v3f(m * aiVector3D(p.x, p.y, p.z)) * w;
    if (!normals.empty()) {
      const V3f q = (*N)[v];
      normals[v] += to_v3f(linear * aiVector3D(q.x, q.y, q.z)) * w;
    }
    sums[v] += w;
  };
  for (unsigned b = 0; b < mesh.mNumBones; ++b) {
    const aiBone& bone = *mesh.mBones[b];
    const aiNode* const joint = find(bone.mName.C_Str());
    if (!joint) continue;
    const aiMatrix4x4 m = global(*joint) * bone.mOffsetMatrix;
    for (unsigned w = 0; w < bone.mNumWeights; ++w)
      if (bone.mWeights[w].mVertexId < n) add(m, bone.mWeights[w].mVertexId, bone.mWeights[w].mWeight);
  }
  const aiMatrix4x4& own = global(node);
  for (size_t v = 0; v < n; ++v) {
    if (!(sums[v] > 1e-6f)) add(own, v, 1 - sums[v]);
    (*P)[v] = placed[v] / sums[v];
    if (!normals.empty()) (*N)[v] = normals[v];
  }
}

}  // namespace dapple::modelfile
