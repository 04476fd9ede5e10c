// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dapple/geom/patch_surface.h"

namespace dapple::geom {

/// The faces of a cage themselves: bilinear quads, other polygons by their corners, middles of edges and means. The
/// cage is clean.
class PolygonSurface final : public PatchSurface {
 public:
  explicit PolygonSurface(ControlCage cage);
  std::unique_ptr<FacePatches> face(uint32_t face) const override;

 private:
  ControlCage cage_;
  std::vector<uint32_t> first_corner_;  ///< of each face
};

}  // namespace dapple::geom
