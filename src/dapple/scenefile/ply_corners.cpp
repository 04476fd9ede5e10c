// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/ply_corners.h"

#include <bit>
#include <limits>

namespace dapple::scenefile {

namespace {
uint64_t bits_of(const V2f& v) {
  return uint64_t(std::bit_cast<uint32_t>(v.x)) << 32 | std::bit_cast<uint32_t>(v.y);
}
}  // namespace

size_t CornerSplitter::KeyHash::operator()(const Key& k) const {
  uint64_t h = (k.uv ^ uint64_t(uint32_t(k.vertex)) * 0x9e3779b97f4a7c15u) * 0xbf58476d1ce4e5b9u;
  h = (h ^ h >> 29) * 0x94d049bb133111ebu;
  return size_t(h ^ h >> 32);
}

CornerSplitter::CornerSplitter(PlyMesh* mesh) : mesh_(*mesh), has_uv_(mesh->P.size(), false) {
  mesh_.uv.resize(mesh_.P.size(), V2f(0, 0));
}

bool CornerSplitter::split(const std::vector<V2f>& uv, std::vector<int32_t>* corners) {
  for (size_t i = 0; i < corners->size(); ++i) {
    int32_t& vertex = (*corners)[i];
    const size_t v = size_t(vertex);
    if (!has_uv_[v]) {
      has_uv_[v] = true;
      mesh_.uv[v] = uv[i];
      continue;
    }
    if (mesh_.uv[v] == uv[i]) continue;
    const auto [at, is_new] = repeated_.try_emplace(Key{vertex, bits_of(uv[i])}, int32_t(mesh_.P.size()));
    if (is_new) {
      if (mesh_.P.size() >= size_t(std::numeric_limits<int32_t>::max())) return false;
      mesh_.P.push_back(mesh_.P[v]);
      if (!mesh_.N.empty()) mesh_.N.push_back(mesh_.N[v]);
      mesh_.uv.push_back(uv[i]);
      mesh_.repeats.push_back(vertex);
    }
    vertex = at->second;
  }
  return true;
}

}  // namespace dapple::scenefile
