// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dapple/base/vec.h"

namespace dapple::scenefile {

/// Cuts polygons into triangles. Convex polygons become fans; others have their ears clipped in the plane they are
/// closest to (Newell's normal). Clipping takes time quadratic in the corners, so the large polygons of one
/// Triangulator share an allowance (about a second); past it they become fans too. The result depends on the polygons
/// and their order only.
class Triangulator {
 public:
  /// Appends corners.size() - 2 triangles of the polygon's orientation to `triangles`. `corners`, at least 3, index P
  /// and are in range.
  void add(std::span<const int32_t> corners, std::span<const V3f> P, std::vector<int32_t>* triangles);

 private:
  size_t corner_pairs_left_ = 100'000'000;
};

}  // namespace dapple::scenefile
