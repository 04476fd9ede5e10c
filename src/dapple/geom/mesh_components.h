// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "dapple/geom/mesh.h"

namespace dapple::geom {

/// The connected components of a mesh. Vertices at the very same place (at shutter open) count as one, since files
/// repeat them where normals or texture coordinates differ. Components are numbered by their first faces.
class MeshComponents {
 public:
  explicit MeshComponents(const Mesh& mesh);

  uint32_t count() const { return uint32_t(first_face_.size() - 1); }
  /// The faces of a component, in the order of the mesh.
  std::span<const uint32_t> faces(uint32_t component) const {
    return {faces_.data() + first_face_[component], faces_.data() + first_face_[component + 1]};
  }

 private:
  std::vector<uint32_t> faces_, first_face_;  ///< the latter in faces_, one more than components
};

}  // namespace dapple::geom
