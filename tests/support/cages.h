// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <map>
#include <set>

#include "dapple/base/hash.h"
#include "dapple/geom/control_cage.h"
#include "dapple/geom/dicing_view.h"
#include "dapple/geom/displacer.h"

namespace dapple::test {

using geom::ControlCage;

/// n x n quads over [0, size]^2 in the plane z = 0; vertex (x, y) is y (n + 1) + x.
inline ControlCage plane_cage(uint32_t n, float size) {
  ControlCage cage;
  for (uint32_t y = 0; y <= n; ++y)
    for (uint32_t x = 0; x <= n; ++x) cage.P.push_back(V3f(float(x), float(y), 0) * (size / float(n)));
  for (uint32_t y = 0; y < n; ++y)
    for (uint32_t x = 0; x < n; ++x) {
      const uint32_t a = y * (n + 1) + x;
      for (const uint32_t v : {a, a + 1, a + n + 2, a + n + 1}) cage.indices.push_back(v);
    }
  cage.face_sizes.assign(n * n, 4);
  return cage;
}

/// The border of a set of unit cubes, in quads seen from outside.
inline ControlCage voxel_cage(const std::set<std::array<int, 3>>& voxels) {
  ControlCage cage;
  std::map<std::array<int, 3>, uint32_t> vertices;
  for (const auto& voxel : voxels)
    for (int axis = 0; axis < 3; ++axis)
      for (const int side : {0, 1}) {
        std::array<int, 3> beside = voxel;
        beside[size_t(axis)] += side ? 1 : -1;
        if (voxels.contains(beside)) continue;
        const int b = (axis + 1) % 3, c = (axis + 2) % 3;
        for (int k = 0; k < 4; ++k) {
          // Counter-clockwise around +axis, or the other way round.
          const int turn = side ? k : 3 - k;
          std::array<int, 3> corner = voxel;
          corner[size_t(axis)] += side;
          corner[size_t(b)] += turn == 1 || turn == 2;
          corner[size_t(c)] += turn >= 2;
          const auto [at, is_new] = vertices.emplace(corner, uint32_t(cage.P.size()));
          if (is_new) cage.P.push_back(V3f(float(corner[0]), float(corner[1]), float(corner[2])));
          cage.indices.push_back(at->second);
        }
        cage.face_sizes.push_back(4);
      }
  return cage;
}

inline ControlCage cube_cage() {
  return voxel_cage({{0, 0, 0}});
}

/// A body with head, arms and legs: valences 3 to 6, creases of all kinds, a triangle and a pentagon. (1, 0.5, 3) lies
/// inside.
inline ControlCage figure_cage() {
  std::set<std::array<int, 3>> voxels;
  for (int z = 2; z < 5; ++z) voxels.insert({0, 0, z}), voxels.insert({1, 0, z});
  for (int x : {-2, -1, 2, 3}) voxels.insert({x, 0, 4});
  for (int z : {0, 1}) voxels.insert({0, 0, z});
  voxels.insert({0, 0, 5}), voxels.insert({1, 0, 1}), voxels.insert({1, 0, 0}), voxels.insert({1, -1, 0}),
      voxels.insert({0, -1, 0});
  voxels.insert({0, 0, 6});
  ControlCage cage = voxel_cage(voxels);
  // Each 11th quad gives a corner to a point of its own: two triangles; each 13th a pyramid of four.
  std::vector<uint32_t> sizes, indices;
  for (uint32_t f = 0; f < cage.face_count(); ++f) {
    const uint32_t* c = &cage.indices[size_t(f) * 4];
    if (f % 11 == 3) {
      for (const uint32_t v : {c[0], c[1], c[2], c[0], c[2], c[3]}) indices.push_back(v);
      sizes.insert(sizes.end(), 2, 3);
    } else if (f % 13 == 5) {
      const uint32_t top = uint32_t(cage.P.size());
      cage.P.push_back((cage.P[c[0]] + cage.P[c[1]] + cage.P[c[2]] + cage.P[c[3]]) * 0.25f);
      for (const uint32_t v : {c[0], c[1], top, c[1], c[2], top, c[2], c[3], c[0], top}) indices.push_back(v);
      sizes.insert(sizes.end(), {3, 3, 4});
    } else {
      indices.insert(indices.end(), c, c + 4);
      sizes.push_back(4);
    }
  }
  cage.indices = indices;
  cage.face_sizes = sizes;
  // Creases along every fifth edge, of sharpness 0 to 12.
  size_t first = 0, edge = 0;
  for (const uint32_t n : sizes) {
    for (uint32_t i = 0; i < n; ++i)
      if (const uint32_t a = indices[first + i], b = indices[first + (i + 1) % n]; a < b && edge++ % 5 == 0) {
        cage.crease_edges.insert(cage.crease_edges.end(), {a, b});
        cage.crease_sharpness.push_back(float(edge / 5 % 13));
      }
    first += n;
  }
  cage.corners = {0, 9};
  cage.corner_sharpness = {10, 2};
  return cage;
}

/// A latitude-longitude sphere of triangles at the poles and quads between, radius 1.
inline ControlCage sphere_cage(uint32_t around, uint32_t rings) {
  ControlCage cage;
  cage.P = {V3f(0, 0, -1), V3f(0, 0, 1)};
  for (uint32_t r = 1; r <= rings; ++r)
    for (uint32_t i = 0; i < around; ++i) {
      const float theta = pi * float(r) / float(rings + 1), phi = 2 * pi * float(i) / float(around);
      cage.P.push_back(V3f(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), -std::cos(theta)));
    }
  const auto at = [&](uint32_t r, uint32_t i) { return 2 + (r - 1) * around + i % around; };
  const auto face = [&](std::initializer_list<uint32_t> f) {
    cage.indices.insert(cage.indices.end(), f);
    cage.face_sizes.push_back(uint32_t(f.size()));
  };
  for (uint32_t i = 0; i < around; ++i) {
    face({0, at(1, i + 1), at(1, i)});
    face({1, at(rings, i), at(rings, i + 1)});
    for (uint32_t r = 1; r < rings; ++r) face({at(r, i), at(r, i + 1), at(r + 1, i + 1), at(r + 1, i)});
  }
  return cage;
}

/// Pixels whose width jumps from cell to cell of space, so that neighbouring patches get very different rates.
class PatchyView final : public geom::DicingView {
 public:
  PatchyView(float width, float cell) : width_(width), inv_cell_(1 / cell) {}
  void pixel_widths(std::span<const V3f> P, float* widths) const override {
    for (size_t i = 0; i < P.size(); ++i) {
      const V3f c = P[i] * inv_cell_;
      const uint64_t h = hash(int64_t(std::floor(c.x)), int64_t(std::floor(c.y)), int64_t(std::floor(c.z)));
      widths[i] = width_ * float(1 << h % 5);
    }
  }

 private:
  float width_, inv_cell_;
};

/// Waves of the given height over space.
class Waves final : public geom::Displacer {
 public:
  Waves(float height, float frequency) : height_(height), frequency_(frequency) {}
  void heights(std::span<const geom::PatchSample> points, float* heights) const override {
    for (size_t i = 0; i < points.size(); ++i) {
      const V3f p = points[i].P * frequency_;
      heights[i] = height_ * std::sin(p.x) * std::sin(1.3f * p.y + 1) * std::cos(0.8f * p.z);
    }
  }

 private:
  float height_, frequency_;
};

}  // namespace dapple::test
