// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "dapple/base/vec.h"

namespace dapple::media {

/// Values at the centres of nx * ny * nz equal cells of the unit cube, x fastest; trilinear between them, falling to
/// zero over half a cell at the faces of the cube (as pbrt-v4).
template <class T>
class VoxelGrid {
 public:
  VoxelGrid() = default;
  /// values: nx * ny * nz of them.
  VoxelGrid(std::vector<T> values, int nx, int ny, int nz) : values_(std::move(values)), nx_(nx), ny_(ny), nz_(nz) {}

  bool empty() const { return values_.empty(); }
  int nx() const { return nx_; }
  int ny() const { return ny_; }
  int nz() const { return nz_; }

  T at(int x, int y, int z) const {
    if (x < 0 || y < 0 || z < 0 || x >= nx_ || y >= ny_ || z >= nz_) return T{};
    return values_[(static_cast<size_t>(z) * ny_ + y) * nx_ + x];
  }

  T lookup(const V3f& p) const {
    const float x = p.x * nx_ - 0.5f, y = p.y * ny_ - 0.5f, z = p.z * nz_ - 0.5f;
    const float fx = std::floor(x), fy = std::floor(y), fz = std::floor(z);
    const int ix = static_cast<int>(fx), iy = static_cast<int>(fy), iz = static_cast<int>(fz);
    const auto row = [&](int j, int k) { return at(ix, j, k) * (1 - (x - fx)) + at(ix + 1, j, k) * (x - fx); };
    const auto slice = [&](int k) { return row(iy, k) * (1 - (y - fy)) + row(iy + 1, k) * (y - fy); };
    return slice(iz) * (1 - (z - fz)) + slice(iz + 1) * (z - fz);
  }

  /// Calls visit(value) with every stored value that a look-up in the box [lo, hi] of the unit cube may read.
  template <class Visit>
  void visit_box(const V3f& lo, const V3f& hi, Visit&& visit) const {
    const auto first = [](float a, int n) { return std::max(static_cast<int>(std::floor(a * n - 0.5f)), 0); };
    const auto last = [](float a, int n) { return std::min(static_cast<int>(std::floor(a * n - 0.5f)) + 1, n - 1); };
    for (int z = first(lo.z, nz_); z <= last(hi.z, nz_); ++z)
      for (int y = first(lo.y, ny_); y <= last(hi.y, ny_); ++y)
        for (int x = first(lo.x, nx_); x <= last(hi.x, nx_); ++x) visit(at(x, y, z));
  }

 private:
  std::vector<T> values_;
  int nx_ = 0, ny_ = 0, nz_ = 0;
};

}  // namespace dapple::media
