// SPDX-License-Identifier: Apache-2.0
#include "dapple/trace/cell_walk.h"

#include <algorithm>
#include <cmath>

namespace dapple::trace {

CellWalk::CellWalk(const RayBatch& rays, int n, const Box2f& cell, const Box3f& bounds) : cell_(cell), bounds_(bounds) {
  bool all[RayBatch::capacity];
  for (int i = 0; i < n; ++i) {
    const float x = into(rays.ox[i], 0), y = into(rays.oy[i], 1);
    segments.set(i, V3f(x, y, rays.oz[i]), rays.direction(i), 0, rays.time[i], rays.key[i], rays.width[i],
                 rays.spread[i]);
    ray[i] = i;
    passed[i] = 0;
    left_[i] = rays.t_max[i];
    all[i] = true;
  }
  count = n;
  keep(all);
}

void CellWalk::measure() {
  for (int i = 0; i < count; ++i) {
    const float tx = to_border(segments.ox[i], segments.dx[i], 0), ty = to_border(segments.oy[i], segments.dy[i], 1);
    along_x_[i] = tx <= ty;
    length_[i] = std::min(tx, ty);
    segments.t_max[i] = std::min(left_[i], length_[i] * (1 + 1e-6f) + 1e-6f * (cell_.max.x - cell_.min.x));
  }
}

void CellWalk::go_on(const bool* wanted) {
  for (int i = 0; i < count; ++i) {
    if (!wanted[i]) continue;
    if (!(length_[i] < infinity)) {  // straight up or down
      left_[i] = 0;
      continue;
    }
    const V3f d = segments.direction(i);
    V3f o = segments.origin(i) + d * length_[i];
    passed[i] += length_[i];
    left_[i] -= length_[i];
    const int axis = along_x_[i] ? 0 : 1;
    o[axis] = d[axis] > 0 ? cell_.min[axis] : cell_.max[axis];
    const int other = 1 - axis;
    o[other] = std::clamp(o[other], cell_.min[other], cell_.max[other]);
    segments.set(i, o, d, 0, segments.time[i], segments.key[i], segments.width[i] + segments.spread[i] * length_[i],
                 segments.spread[i]);
  }
  keep(wanted);
}

float CellWalk::into(float x, int axis) const {
  const double low = cell_.min[axis], size = double(cell_.max[axis]) - low;
  const double inside = x - std::floor((x - low) / size) * size;
  return std::clamp(float(inside), cell_.min[axis], cell_.max[axis]);
}

float CellWalk::to_border(float o, float d, int axis) const {
  if (d == 0) return infinity;
  return std::max(0.0f, ((d > 0 ? cell_.max[axis] : cell_.min[axis]) - o) / d);
}

// Moves the rays that go on to the front; those that have left all there is above or below do not.
void CellWalk::keep(const bool* wanted) {
  int kept = 0;
  for (int i = 0; i < count; ++i) {
    const float z = segments.oz[i], dz = segments.dz[i];
    const bool gone = (z > bounds_.max.z && dz >= 0) || (z < bounds_.min.z && dz <= 0);
    if (!wanted[i] || gone || !(left_[i] > 0)) continue;
    segments.set(kept, segments.origin(i), segments.direction(i), 0, segments.time[i], segments.key[i],
                 segments.width[i], segments.spread[i]);
    ray[kept] = ray[i], passed[kept] = passed[i], left_[kept] = left_[i];
    ++kept;
  }
  count = kept;
}

}  // namespace dapple::trace
