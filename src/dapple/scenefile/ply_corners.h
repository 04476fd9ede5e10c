// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "dapple/base/vec.h"
#include "dapple/scenefile/ply_reader.h"

namespace dapple::scenefile {

/// Texture coordinates by corner of faces become such by vertex: a vertex keeps the first that it has, and is repeated
/// for each further one.
class CornerSplitter {
 public:
  /// The mesh with all vertices, before its vertices are split. Must outlive this object.
  explicit CornerSplitter(PlyMesh* mesh);
  /// `uv`: one a corner. The corners, which are in range, come to name vertices that have these coordinates. False if
  /// there are more vertices than an index can tell.
  bool split(const std::vector<V2f>& uv, std::vector<int32_t>* corners);

 private:
  struct Key {
    int32_t vertex;
    uint64_t uv;  ///< bits
    bool operator==(const Key&) const = default;
  };
  struct KeyHash {
    size_t operator()(const Key& k) const;
  };

  PlyMesh& mesh_;
  std::vector<bool> has_uv_;
  std::unordered_map<Key, int32_t, KeyHash> repeated_;
};

}  // namespace dapple::scenefile
