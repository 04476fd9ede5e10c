// SPDX-License-Identifier: Apache-2.0
#include "dapple/scenefile/far_points.h"

#include <algorithm>
#include <cmath>

namespace dapple::scenefile {

namespace {

constexpr double extents_off = 16;

// Of one axis; a whole number, so that floats minus it stay floats.
double base_of(double least, double most) {
  if (least > most || (least < 0) != (most < 0)) return 0;
  const double nearest = std::min(std::abs(least), std::abs(most));
  if (nearest < nearest_far || nearest < extents_off * (most - least)) return 0;
  return std::floor(least);
}

template <class Get, class Set>
V3d take_off(size_t count, const Get& get, const Set& set) {
  V3d base(0, 0, 0);
  for (int axis = 0; axis < 3; ++axis) {
    double least = std::numeric_limits<double>::infinity(), most = -least;
    for (size_t i = 0; i < count; ++i) least = std::min(least, get(i, axis)), most = std::max(most, get(i, axis));
    base[axis] = base_of(least, most);
    for (size_t i = 0; i < count; ++i) set(i, axis, float(get(i, axis) - base[axis]));
  }
  return base;
}

}  // namespace

bool may_be_far(std::span<const float> xyz) {
  return std::any_of(xyz.begin(), xyz.end(), [](float v) { return std::abs(v) >= float(nearest_far); });
}

V3d take_off_base(std::span<const double> xyz, std::span<float> rest) {
  return take_off(
      xyz.size() / 3, [&](size_t i, int k) { return xyz[3 * i + size_t(k)]; },
      [&](size_t i, int k, float v) { rest[3 * i + size_t(k)] = v; });
}

V3d take_off_base(std::vector<V3f>* points) {
  if (points->empty() || !may_be_far({&points->front().x, 3})) return V3d(0, 0, 0);
  return take_off(
      points->size(), [&](size_t i, int k) { return double((*points)[i][k]); },
      [&](size_t i, int k, float v) { (*points)[i][k] = v; });
}

V3d take_off_base(std::span<const V3d> points, std::vector<V3f>* rest) {
  rest->resize(points.size());
  return take_off(
      points.size(), [&](size_t i, int k) { return points[i][k]; },
      [&](size_t i, int k, float v) { (*rest)[i][k] = v; });
}

}  // namespace dapple::scenefile
