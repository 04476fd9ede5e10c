// SPDX-License-Identifier: Apache-2.0
#include "dapple/trace/bulk_bounds.h"

#include <algorithm>

#include "dapple/base/hash.h"

namespace dapple::trace {

namespace {

constexpr size_t about_points = 4096;
constexpr size_t most_placed = size_t(1) << 20;
constexpr size_t left_out = 20;  // one of so many, at each end of an axis

size_t primitive_count(const Shape& shape) {
  if (const auto* mesh = std::get_if<MeshPtr>(&shape)) return (*mesh)->face_count();
  if (const auto* grids = std::get_if<GridsPtr>(&shape)) return (*grids)->grids.size();
  if (const auto* disks = std::get_if<DisksPtr>(&shape)) return (*disks)->disks.size();
  if (const auto* curves = std::get_if<CurvesPtr>(&shape)) return (*curves)->segment_count();
  return 1;
}

V3f middle_of(const TracedScene& scene, uint32_t geometry, size_t primitive) {
  const Shape& shape = scene.shape(geometry);
  if (const auto* quadric = std::get_if<QuadricPtr>(&shape)) return (*quadric)->bounds().center();
  if (const auto* disks = std::get_if<DisksPtr>(&shape)) return (*disks)->disks[primitive].centre;
  return scene.local_surface(geometry, uint32_t(primitive), 1 / 3.0f, 1 / 3.0f, 0).P;
}

}  // namespace

Box3f bulk_bounds(const TracedScene& scene) {
  std::vector<size_t> primitives(scene.geometry_count());
  for (uint32_t g = 0; g < primitives.size(); ++g) primitives[g] = primitive_count(scene.shape(g));
  const auto each_placed = [&scene](const auto& visit) {
    for (const uint32_t g : scene.geometries_in(no_id)) visit(no_id, g);
    // Of a great many placements one at random of each stretch, since paths follow each other in a pattern.
    const size_t singles = scene.single_count(), others = scene.instance_count() - singles;
    const size_t stretch = (others + most_placed - 1) / most_placed;
    const auto visit_all = [&](uint32_t i) {
      for (const uint32_t g : scene.geometries_in(scene.object_of(i))) visit(i, g);
    };
    for (uint32_t i = 0; i < singles; ++i) visit_all(i);
    for (size_t first = 0; first < others; first += std::max<size_t>(stretch, 1)) {
      const size_t length = std::min(stretch, others - first);
      visit_all(uint32_t(singles + first + (length > 1 ? hash(uint64_t(first)) % length : 0)));
    }
  };
  size_t total = 0;
  each_placed([&](uint32_t, uint32_t g) { total += primitives[g]; });
  const size_t stride = std::max<size_t>(total / about_points, 1);

  std::vector<float> middles[3];
  size_t next = 0;  // primitive of those that lie ahead
  each_placed([&](uint32_t instance, uint32_t g) {
    for (; next < primitives[g]; next += stride) {
      const V3f local = middle_of(scene, g, next),
                p = instance == no_id ? local : scene.instance_point(instance, local);
      for (int axis = 0; axis < 3; ++axis) middles[axis].push_back(p[axis]);
    }
    next -= primitives[g];
  });
  Box3f box;
  const size_t n = middles[0].size();
  if (n == 0) return box;
  for (int axis = 0; axis < 3; ++axis) {
    std::sort(middles[axis].begin(), middles[axis].end());
    box.min[axis] = middles[axis][n / left_out];
    box.max[axis] = middles[axis][n - 1 - n / left_out];
  }
  return box;
}

}  // namespace dapple::trace
