// SPDX-License-Identifier: Apache-2.0
#include "dapple/media/majorant_grid.h"

#include <algorithm>
#include <utility>

namespace dapple::media {

MajorantWalk::MajorantWalk(const MajorantGrid& grid, const V3f& o, const V3f& d, float t_max)
    : grid_(grid), o_(o), d_(d) {
  float end = t_max;
  for (int k = 0; k < 3; ++k) {
    const float inverse = 1 / d_[k];
    float near = -o_[k] * inverse, far = (1 - o_[k]) * inverse;
    if (d_[k] == 0) {
      near = o_[k] >= 0 && o_[k] < 1 ? -infinity : infinity;
      far = infinity;
    }
    if (near > far) std::swap(near, far);
    first_ = std::max(first_, near);
    end = std::min(end, far);
  }
  if (!(first_ < end)) return;
  end_ = end - first_;
  o_ += d_ * first_;  // so that lengths in the cube do not drown in the way to it
  enter_first_cell();
}

void MajorantWalk::enter_first_cell() {
  const std::array<int, 3> n = {grid_.nx, grid_.ny, grid_.nz};
  const V3f p = position();
  for (int k = 0; k < 3; ++k) {
    const float at = p[k] * n[k];
    cell_[k] = std::clamp(static_cast<int>(at), 0, n[k] - 1);
    const int forward = d_[k] > 0 ? 1 : 0;
    step_[k] = d_[k] > 0 ? 1 : -1;
    limit_[k] = d_[k] > 0 ? n[k] : -1;
    crossing_[k] = d_[k] != 0 ? (static_cast<float>(cell_[k] + forward) / n[k] - o_[k]) / d_[k] : infinity;
    delta_[k] = d_[k] != 0 ? 1 / (n[k] * std::abs(d_[k])) : infinity;
  }
}

std::vector<std::string> GivenUp::warnings(const std::string& name) const {
  if (count() == 0) return {};
  return {name + ": " + std::to_string(count()) +
          " rays met its largest extinction too often and count as absorbed; it differs too much between channels or "
          "places"};
}

}  // namespace dapple::media
