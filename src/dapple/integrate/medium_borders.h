// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "dapple/integrate/material_table.h"

namespace dapple::integrate {

/// The surfaces of a scene through which light goes from one medium into another, by themselves. Where it is known
/// otherwise what stands in the way of light, by masks, rays through these alone tell what the media leave of it.
class MediumBorders {
 public:
  static constexpr uint64_t most_places = 4096;  ///< of objects that hold such surfaces

  /// Why they cannot stand by themselves; empty: they can, or the scene has none.
  static std::string obstacle(const scene::Scene& scene, const MaterialTable& materials);
  /// Null if the scene has none. Of a scene without an obstacle.
  static std::shared_ptr<const MediumBorders> find(const scene::Scene& scene, const MaterialTable& materials);

  /// Nearest hits; geometries are those of `traced()`.
  const trace::TracedScene& traced() const { return traced_; }
  /// The scene's number of a geometry of traced().
  uint32_t geometry(uint32_t own) const { return geometries_[own]; }

 private:
  trace::TracedScene traced_;
  std::vector<uint32_t> geometries_;
};

}  // namespace dapple::integrate
