// SPDX-License-Identifier: Apache-2.0
#include "dapple/trace/shape.h"

#include <algorithm>
#include <cmath>

namespace dapple::trace {

Box3f bounds_of(const Shape& shape) {
  Box3f box;
  const auto add = [&box](const std::vector<V3f>& points) {
    for (const V3f& p : points) box.extendBy(p);
  };
  if (const auto* mesh = std::get_if<MeshPtr>(&shape)) {
    add((*mesh)->P), add((*mesh)->P_end);
  } else if (const auto* grids = std::get_if<GridsPtr>(&shape)) {
    add((*grids)->P), add((*grids)->P_end);
  } else if (const auto* disks = std::get_if<DisksPtr>(&shape)) {
    for (size_t i = 0; i < (*disks)->disks.size(); ++i) {
      const auto& d = (*disks)->disks[i];
      const V3f& n = (*disks)->normals[i];
      V3f reach;
      for (int k = 0; k < 3; ++k) reach[k] = d.radius * std::sqrt(std::max(0.0f, 1 - n[k] * n[k]));
      box.extendBy(d.centre - reach);
      box.extendBy(d.centre + reach);
    }
  } else if (const auto* curves = std::get_if<CurvesPtr>(&shape)) {
    for (const auto& c : (*curves)->control_points) {
      box.extendBy(c.P - V3f(c.radius));
      box.extendBy(c.P + V3f(c.radius));
    }
  } else {
    box = std::get<QuadricPtr>(shape)->bounds();
  }
  return box;
}

}  // namespace dapple::trace
