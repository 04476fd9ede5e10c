// SPDX-License-Identifier: Apache-2.0
// Rays through a scene that is repeated along x and y, cell by cell.
#include <cmath>

#include "dapple/trace/traced_scene.h"

namespace dapple::trace {

namespace {

// Ends rays that run level between what there is; a path over this many cells has lost all its light long before.
constexpr int max_cells = 4096;

/// Rays of a batch that are still under way, each with its place in its cell.
class CellWalk {
 public:
  CellWalk(const RayBatch& rays, int n, const Box2f& cell, const Box3f& bounds) : cell_(cell), bounds_(bounds) {
    for (int i = 0; i < n; ++i) {
      const float x = into(rays.ox[i], 0), y = into(rays.oy[i], 1);
      segments.set(i, V3f(x, y, rays.oz[i]), rays.direction(i), 0, rays.time[i], rays.key[i], rays.width[i],
                   rays.spread[i]);
      ray[i] = i;
      passed[i] = 0;
      left_[i] = rays.t_max[i];
    }
    count = n;
    keep([](int) { return true; });
  }

  /// Ends each ray's segment where it leaves its cell. A little beyond, so that nothing slips through between two
  /// cells.
  void measure() {
    for (int i = 0; i < count; ++i) {
      const float tx = to_border(segments.ox[i], segments.dx[i], 0), ty = to_border(segments.oy[i], segments.dy[i], 1);
      along_x_[i] = tx <= ty;
      length_[i] = std::min(tx, ty);
      segments.t_max[i] = std::min(left_[i], length_[i] * (1 + 1e-6f) + 1e-6f * (cell_.max.x - cell_.min.x));
    }
  }

  /// Takes the rays for which wanted(i) says so to their next cells; the others end.
  template <class Wanted>
  void go_on(const Wanted& wanted) {
    for (int i = 0; i < count; ++i) {
      if (!wanted(i)) continue;
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

  int count = 0;
  int ray[RayBatch::capacity];        ///< number in the batch
  double passed[RayBatch::capacity];  ///< distance to the segment's origin
  RayBatch segments;

 private:
  float into(float x, int axis) const {
    const double low = cell_.min[axis], size = double(cell_.max[axis]) - low;
    const double inside = x - std::floor((x - low) / size) * size;
    return std::clamp(float(inside), cell_.min[axis], cell_.max[axis]);
  }
  float to_border(float o, float d, int axis) const {
    if (d == 0) return infinity;
    return std::max(0.0f, ((d > 0 ? cell_.max[axis] : cell_.min[axis]) - o) / d);
  }
  // Moves the rays that go on to the front; those that have left all there is above or below do not.
  template <class Wanted>
  void keep(const Wanted& wanted) {
    int kept = 0;
    for (int i = 0; i < count; ++i) {
      const float z = segments.oz[i], dz = segments.dz[i];
      const bool gone = (z > bounds_.max.z && dz >= 0) || (z < bounds_.min.z && dz <= 0);
      if (!wanted(i) || gone || !(left_[i] > 0)) continue;
      segments.set(kept, segments.origin(i), segments.direction(i), 0, segments.time[i], segments.key[i],
                   segments.width[i], segments.spread[i]);
      ray[kept] = ray[i], passed[kept] = passed[i], left_[kept] = left_[i];
      ++kept;
    }
    count = kept;
  }

  const Box2f cell_;
  const Box3f bounds_;
  float left_[RayBatch::capacity], length_[RayBatch::capacity];
  bool along_x_[RayBatch::capacity];
};

}  // namespace

void TracedScene::walk_intersect(const RayBatch& rays, int n, HitBatch* hits) const {
  CellWalk walk(rays, n, *period_, bounds_);
  for (int i = 0; i < n; ++i) {
    hits->geometry[i] = hits->instance[i] = no_id;
    hits->t[i] = rays.t_max[i];
    hits->channels[i] = all_channels;
  }
  HitBatch found;
  for (int cell = 0; walk.count > 0 && cell < max_cells; ++cell) {
    walk.measure();
    intersect_cell(top_.scene, walk.segments, walk.count, &found);
    for (int i = 0; i < walk.count; ++i) {
      const int ray = walk.ray[i];
      if (has_colored_opacity_) found.channels[i] &= hits->channels[ray];
      hits->channels[ray] = found.channels[i];
      if (found.geometry[i] == no_id) continue;
      hits->copy_lane(ray, found, i);
      hits->t[ray] = float(walk.passed[i] + found.t[i]);
    }
    walk.go_on([&](int i) { return found.geometry[i] == no_id; });
  }
}

void TracedScene::walk_transmitted(const RayBatch& rays, int n, RGB* passed) const {
  CellWalk walk(rays, n, *period_, bounds_);
  std::fill_n(passed, n, RGB(1));
  RGB found[RayBatch::capacity];
  for (int cell = 0; walk.count > 0 && cell < max_cells; ++cell) {
    walk.measure();
    transmitted_cell(walk.segments, walk.count, found);
    for (int i = 0; i < walk.count; ++i) passed[walk.ray[i]] *= found[i];
    walk.go_on([&](int i) { return !passed[walk.ray[i]].is_black(); });
  }
}

}  // namespace dapple::trace
