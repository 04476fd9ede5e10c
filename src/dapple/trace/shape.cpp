// SPDX-License-Identifier: Apache-2.0
#include "dapple/trace/shape.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace dapple::trace {

namespace {

template <class T>
bool same(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

bool same(const geom::Mesh& a, const geom::Mesh& b) {
  return a.corners == b.corners && a.flip == b.flip && same(a.P, b.P) && same(a.P_end, b.P_end) && same(a.N, b.N) &&
         same(a.uv, b.uv) && same(a.indices, b.indices) && same(a.source_face, b.source_face);
}

bool same(const geom::GridMesh& a, const geom::GridMesh& b) {
  return a.flip == b.flip && same(a.P, b.P) && same(a.P_end, b.P_end) && same(a.N, b.N) && same(a.uv, b.uv) &&
         same(a.grids, b.grids) && a.parts == b.parts;
}

bool same(const geom::DiskCloud& a, const geom::DiskCloud& b) {
  return same(a.disks, b.disks) && same(a.normals, b.normals);
}

bool same(const geom::CurveSet& a, const geom::CurveSet& b) {
  return a.kind == b.kind && same(a.control_points, b.control_points) && same(a.normals, b.normals) &&
         same(a.u_range, b.u_range);
}

bool same(const geom::Quadric& a, const geom::Quadric& b) {
  return a == b;
}

}  // namespace

float parameter_area(const Shape& shape, uint32_t primitive, const V3f& normal) {
  if (std::holds_alternative<MeshPtr>(shape)) return length(normal);
  const auto* grids = std::get_if<GridsPtr>(&shape);
  if (!grids) return 0;
  const geom::GridMesh::Grid& grid = (*grids)->grids[primitive];
  return length(normal) * float((grid.columns - 1) * (grid.rows - 1));
}

bool same_shape(const Shape& a, const Shape& b) {
  if (a == b) return true;
  return std::visit(
      [](const auto& x, const auto& y) {
        if constexpr (std::is_same_v<decltype(x), decltype(y)>)
          return same(*x, *y);
        else
          return false;
      },
      a, b);
}

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
